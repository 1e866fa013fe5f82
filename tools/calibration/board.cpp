#include "tools/calibration/board.hpp"

#include <map>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace beckon {
namespace {

const std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME>& Dictionaries() {
  static const std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME> names = {
      {"4x4_50", cv::aruco::DICT_4X4_50}, {"4x4_100", cv::aruco::DICT_4X4_100},
      {"5x5_50", cv::aruco::DICT_5X5_50}, {"5x5_100", cv::aruco::DICT_5X5_100},
      {"6x6_50", cv::aruco::DICT_6X6_50}, {"6x6_250", cv::aruco::DICT_6X6_250},
      {"7x7_50", cv::aruco::DICT_7X7_50}, {"original", cv::aruco::DICT_ARUCO_ORIGINAL}};
  return names;
}

cv::Ptr<cv::aruco::CharucoBoard> MakeCharuco(const Board& board) {
  return cv::aruco::CharucoBoard::create(
      board.columns, board.rows, static_cast<float>(board.square_m),
      static_cast<float>(board.marker_m),
      cv::aruco::getPredefinedDictionary(Dictionaries().at(board.dictionary)));
}

std::vector<BoardCorner> FindChessboard(const cv::Mat& grey, const Board& board) {
  const cv::Size size(board.corner_columns(), board.corner_rows());
  std::vector<cv::Point2f> pixels;
  const int flags = cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY | cv::CALIB_CB_NORMALIZE_IMAGE;
  if (!cv::findChessboardCornersSB(grey, size, pixels, flags)) return {};
  const auto at = [&](int column, int row) {
    const cv::Point2f& pixel = pixels[static_cast<std::size_t>(row * size.width + column)];
    return Eigen::Vector2d(pixel.x, pixel.y);
  };
  // Seen from its printed side, rows follow one another clockwise of their own direction.
  const Eigen::Vector2d along = at(size.width - 1, 0) - at(0, 0);
  const Eigen::Vector2d down = at(0, size.height - 1) - at(0, 0);
  const bool is_mirrored = along.x() * down.y() - along.y() * down.x() < 0.0;
  std::vector<BoardCorner> corners;
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const int from = is_mirrored ? size.width - 1 - column : column;
      corners.push_back({board.square_m * Eigen::Vector2d(column, row), at(from, row)});
    }
  }
  return corners;
}

std::vector<BoardCorner> FindCharuco(const cv::Mat& grey, const Board& board) {
  const auto charuco = MakeCharuco(board);
  const auto parameters = cv::aruco::DetectorParameters::create();
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> marker_ids;
  cv::aruco::detectMarkers(grey, charuco->dictionary, markers, marker_ids, parameters);
  std::vector<cv::Point2f> pixels;
  std::vector<int> ids;
  if (marker_ids.empty() ||
      cv::aruco::interpolateCornersCharuco(markers, marker_ids, grey, charuco, pixels, ids) == 0) {
    return {};
  }
  // OpenCV 4.6 tells these with the corner of the first pixel at (0, 0), unlike everything else.
  constexpr double kOffset = 0.5;
  std::vector<BoardCorner> corners;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const cv::Point3f& place = charuco->chessboardCorners[static_cast<std::size_t>(ids[i])];
    corners.push_back({{static_cast<double>(place.x) - board.square_m,
                        static_cast<double>(place.y) - board.square_m},
                       {pixels[i].x - kOffset, pixels[i].y - kOffset}});
  }
  return corners;
}

}  // namespace

Board ReadBoard(ConfigTable& table) {
  Board board;
  std::string kind = "chessboard";
  table.OptionalChoice("kind", kind, {"chessboard", "charuco"});
  board.kind = kind == "charuco" ? BoardKind::kCharuco : BoardKind::kChessboard;
  table.Required("columns", board.columns, Range{4, 60});
  table.Required("rows", board.rows, Range{4, 60});
  table.Required("square_m", board.square_m, Range{0.002, 1.0});
  if (board.columns == board.rows) {
    table.Fail("rows",
               "a board with as many rows as columns looks the same from two sides: its "
               "numbers have to differ");
  }
  if (board.kind == BoardKind::kCharuco) {
    table.Required("marker_m", board.marker_m, Range{0.001, board.square_m});
    std::vector<std::string> names;
    for (const auto& [name, unused] : Dictionaries()) names.push_back(name);
    table.OptionalChoice("dictionary", board.dictionary, names);
    const auto dictionary = cv::aruco::getPredefinedDictionary(Dictionaries().at(board.dictionary));
    if (board.columns * board.rows / 2 > dictionary->bytesList.rows) {
      table.Fail("dictionary", "has fewer markers than a board of " +
                                   std::to_string(board.columns) + " x " +
                                   std::to_string(board.rows) + " squares needs");
    }
  }
  return board;
}

cv::Mat DrawBoard(const Board& board, int square_px) {
  const cv::Size size((board.columns + 2) * square_px, (board.rows + 2) * square_px);
  cv::Mat picture(size, CV_8UC1, cv::Scalar(255));
  if (board.kind == BoardKind::kCharuco) {
    MakeCharuco(board)->draw(size, picture, square_px, 1);
    return picture;
  }
  for (int row = 0; row < board.rows; ++row) {
    for (int column = row % 2; column < board.columns; column += 2) {
      picture(cv::Rect((column + 1) * square_px, (row + 1) * square_px, square_px, square_px)) = 0;
    }
  }
  return picture;
}

std::vector<BoardCorner> FindBoard(const cv::Mat& picture, const Board& board,
                                   const std::string& name) {
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  const bool is_charuco = board.kind == BoardKind::kCharuco;
  std::vector<BoardCorner> corners =
      is_charuco ? FindCharuco(grey, board) : FindChessboard(grey, board);
  constexpr std::size_t kLeast = 8;  // of a ChArUco board that is partly out of view
  if (corners.size() < kLeast) {
    throw CalibrationError(name + ": no " + (is_charuco ? "ChArUco board" : "chessboard") + " of " +
                           std::to_string(board.columns) + " x " + std::to_string(board.rows) +
                           " squares is found in it (" +
                           (is_charuco ? "at least 8 of its corners have to be seen"
                                       : "all of it has to be seen, with a white margin") +
                           ", sharp and not too far away)");
  }
  return corners;
}

std::vector<BoardCorner> HalfTurned(std::vector<BoardCorner> corners, const Board& board) {
  for (BoardCorner& corner : corners) corner.board_m = board.extent() - corner.board_m;
  return corners;
}

}  // namespace beckon
