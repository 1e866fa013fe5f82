// Motion of the robot over the ground, from pixels that show ground. With the calibrated homography
// it has three degrees of freedom, and they are estimated directly: hypotheses from two points each
// (Fischler and Bolles 1981), then robust least squares on the error in the picture.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "common/frames.hpp"
#include "common/ground_camera.hpp"

namespace beckon {

enum class MotionStatus : std::uint8_t {
  kOk = 0,
  kTooFewFeatures = 1,
  kInconsistent = 2,
  kRestart = 3
};

struct PlanarMotion {
  MotionStatus status = MotionStatus::kRestart;
  Pose2 from_to;  // pose of the robot at the newer time in the robot frame at the older time
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of (x, y, theta), m^2, m rad, rad^2
  int inliers = 0;
};

// A point of the ground and where it is seen now.
struct GroundMatch {
  Eigen::Vector2d point;  // m, in the frame that the pose is wanted in
  Eigen::Vector2d pixel;  // ideal pixel of the newest frame
  double sigma_px = 1.0;  // standard deviation of the difference between prediction and pixel
};

struct MotionOptions {
  double tolerance_px = 2.5;  // a match that errs by less than this many sigma_px is an inlier
  int min_inliers = 10;
  double min_inlier_ratio = 0.3;
  int hypotheses = 150;
};

struct PoseEstimate {
  MotionStatus status = MotionStatus::kTooFewFeatures;
  Pose2 frame_from_robot;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::vector<bool> inlier;  // one for each match
  int inliers = 0;
};

// The pose of the robot from which the matches appear where they do. `predicted` competes with the
// hypotheses; whatever it is, the matches decide. Deterministic.
PoseEstimate EstimatePose(const GroundCamera& camera, std::span<const GroundMatch> matches,
                          const Pose2& predicted, const MotionOptions& options);

// Pixel homography that takes where a point is seen now to where it was seen before, for points on
// a plane parallel to the ground: `height_ratio` is the height of the plane over the height of the
// camera (0 for the ground; not 1). A plane that is closer to the camera moves like the ground
// under a camera that translates by 1 / (1 - height_ratio) as much.
Eigen::Matrix3d BeforeFromNow(const GroundCamera& camera, const Pose2& before_from_now,
                              double height_ratio);

}  // namespace beckon
