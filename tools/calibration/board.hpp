// The boards that a camera is calibrated with: drawing them, and finding them in pictures.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/config.hpp"

namespace beckon {

// Something a person has to mend: the text says what and where.
class CalibrationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class BoardKind { kChessboard, kCharuco };

struct Board {
  BoardKind kind = BoardKind::kChessboard;
  int columns = 10;  // squares across; differs from `rows`, or nobody knows which way it lies
  int rows = 7;
  double square_m = 0.03;
  double marker_m = 0.022;  // ChArUco: side of a marker
  std::string dictionary = "4x4_50";

  // Inner corners: where four squares meet.
  int corner_columns() const { return columns - 1; }
  int corner_rows() const { return rows - 1; }
  // From the first inner corner to the last of its row, and to that of the last row, m.
  Eigen::Vector2d extent() const {
    return Eigen::Vector2d(corner_columns() - 1, corner_rows() - 1) * square_m;
  }
};

// Reads kind, columns, rows, square_m, marker_m and dictionary.
Board ReadBoard(ConfigTable& table);

// CV_8UC1, `square_px` pixels a square with a margin of one square all round: to be printed, or
// laid on a simulated floor.
cv::Mat DrawBoard(const Board& board, int square_px);

struct BoardCorner {
  Eigen::Vector2d board_m;  // x along the rows, y down the page, from the first inner corner
  Eigen::Vector2d pixel;    // as taken
};

// All inner corners of a chessboard; those that can be seen of a ChArUco board. A chessboard turned
// by half a turn is the same board: whoever knows where it lies has to try both ways. Throws
// CalibrationError, naming the picture, where the board is not found.
std::vector<BoardCorner> FindBoard(const cv::Mat& picture, const Board& board,
                                   const std::string& name);

// The same corners for one who reads the board upside down.
std::vector<BoardCorner> HalfTurned(std::vector<BoardCorner> corners, const Board& board);

}  // namespace beckon
