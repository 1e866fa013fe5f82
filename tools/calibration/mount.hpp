// Where a camera sits on the robot, and the homography from its picture to the floor that follows.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/ground_camera.hpp"
#include "tools/calibration/board.hpp"
#include "tools/calibration/lens.hpp"

namespace beckon {

// A mark on the floor, measured with a tape and found in the picture by hand.
struct FloorMark {
  Eigen::Vector2d floor_m;  // x forward, y left, m
  Eigen::Vector2d pixel;    // as taken
  std::string name;         // for messages: "points.csv:7"
};

// A board on the floor. The ends of one of its outer rows of inner corners were measured, so that
// the rest of the board lies to the right of the way from the first to the second.
struct FloorBoard {
  std::vector<BoardCorner> corners;
  Eigen::Vector2d first_m;
  Eigen::Vector2d second_m;
  std::string name;  // of the picture
};

struct MountInput {
  cv::Size size;             // of the pictures, pixels
  std::optional<Lens> lens;  // without one: no distortion, square pixels, centre in the middle
  Board board;
  std::vector<FloorMark> marks;
  std::vector<FloorBoard> boards;
  // Where the point below the camera is, in the frame that was measured in.
  Eigen::Vector2d camera_at = Eigen::Vector2d::Zero();
  std::optional<double> camera_height_m;  // of the optical centre, where it was measured
};

struct Mount {
  GroundCamera camera;
  double pan_rad = 0.0;   // of the optical axis, counter-clockwise from robot x
  double roll_rad = 0.0;  // positive: the picture's right side is lower than its left
  double rms_px = 0.0;    // reprojection error of all corners and marks
  double worst_px = 0.0;
  std::string worst_name;
  bool fits_focal_length = false;  // since there was no lens
  Eigen::VectorXd parameters;      // of the fit, with their covariance
  Eigen::MatrixXd covariance;

  // Standard deviation of the range of a floor point straight ahead, m: what the errors of tape and
  // pictures leave.
  double RangeSigma(double range_m) const;
};

// Weighted least squares over the camera's pose, where each board lies, and the focal length where
// there is no lens: errors of a picture are told in pixels, those of the tape in millimetres, and
// each counts by what can be expected of it. (That a board is measured 5 mm wrong at 1.5 m would
// tilt the horizon by a pixel, and put what is 6 m away 8 % off.)
//
// Throws CalibrationError, with what to mend, for input from which no honest camera comes: too few
// marks, all on one line, too close together, mirrored, above the horizon, at odds with each other
// or with what was measured of the camera.
Mount SolveMount(const MountInput& input);

}  // namespace beckon
