// The least squares fit behind SolveMount(): its parameters, its residuals, and where it begins.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "tools/calibration/mount.hpp"

namespace beckon {

// What can be expected of a person with a tape measure, and of corners in a picture.
inline constexpr double kTapeSigmaM = 0.005;
inline constexpr double kCameraAtSigmaM = 0.02;
inline constexpr double kHeightSigmaM = 0.01;
inline constexpr double kBoardSigmaPx = 0.3;
inline constexpr double kMarkSigmaPx = 1.0;

inline constexpr int kPoseParameters = 6;   // turn vector and translation, camera from floor
inline constexpr int kBoardParameters = 3;  // x, y of its first corner, direction of its rows

// Where a point of a board lies. Seen from above the page, y down the page is to the right of x
// along it.
Eigen::Vector2d FloorFromBoard(const Eigen::Vector2d& origin_m, double direction_rad,
                               const Eigen::Vector2d& board_m);

// A camera over the floor, without distortion.
struct MountView {
  Eigen::Matrix3d camera_from_floor;  // turns floor axes into those of the camera
  Eigen::Vector3d translation;
  double fx, fy, cx, cy;

  Eigen::Vector2d Project(const Eigen::Vector2d& floor_m) const {
    const Eigen::Vector3d point =
        camera_from_floor * Eigen::Vector3d(floor_m.x(), floor_m.y(), 0.0) + translation;
    // A step of the search may put a point behind the camera; it must not be drawn there.
    const double depth = std::max(point.z(), 1e-3);
    return {fx * point.x() / depth + cx, fy * point.y() / depth + cy};
  }
  Eigen::Vector3d Centre() const { return -camera_from_floor.transpose() * translation; }
};

// The fit as a function from parameters to residuals, each in units of its standard deviation.
class MountResiduals {
 public:
  using Scalar = double;  // for Eigen::LevenbergMarquardt

  // `input` has to outlive this.
  explicit MountResiduals(const MountInput& input);

  int boards_at() const { return kPoseParameters + (input_->lens ? 0 : 1); }
  int marks_at() const {
    return boards_at() + kBoardParameters * static_cast<int>(input_->boards.size());
  }
  int inputs() const { return marks_at() + 2 * static_cast<int>(input_->marks.size()); }
  int values() const { return values_; }
  const std::vector<Eigen::Vector2d>& mark_pixels() const { return mark_pixels_; }
  const std::vector<Eigen::Vector2d>& board_pixels(std::size_t board) const {
    return board_pixels_[board];
  }

  MountView ViewOf(const Eigen::VectorXd& p) const;
  Eigen::Vector2d CornerOnFloor(const Eigen::VectorXd& p, std::size_t board,
                                const Eigen::Vector2d& board_m) const;

  // Residuals and their derivatives, for Eigen::LevenbergMarquardt; always 0.
  int operator()(const Eigen::VectorXd& p, Eigen::VectorXd& residuals) const;

  int df(const Eigen::VectorXd& p, Eigen::MatrixXd& jacobian) const;

 private:
  const MountInput* input_;
  std::vector<Eigen::Vector2d> mark_pixels_;                // ideal
  std::vector<std::vector<Eigen::Vector2d>> board_pixels_;  // ideal
  int values_ = 0;
};

// A floor point as it was measured, as if the tape did not err, and its pixel, free of distortion.
struct FloorPoint {
  Eigen::Vector2d floor_m;
  Eigen::Vector2d ideal;
};

std::vector<FloorPoint> FloorPoints(const MountInput& input, const MountResiduals& residuals);

// The camera over the origin of its own frame, which has the axes of the measured one.
GroundCamera CameraOf(const MountView& view, const MountInput& input);

// The fit without any judgement of it. Throws CalibrationError where no camera is even a beginning.
Mount Fit(const MountInput& input, const MountResiduals& residuals);

}  // namespace beckon
