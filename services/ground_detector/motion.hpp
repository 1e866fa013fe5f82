// The planar motion of a body that leans a little, from points of the ground.
#pragma once

#include <Eigen/Core>
#include <cstdint>
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

// Where the body is on the plane, and how it leans away from the pose in which the camera was
// calibrated: pitch and roll as in ground_t.
struct BodyPose {
  Pose2 frame_from_robot;
  double pitch_rad = 0.0;
  double roll_rad = 0.0;
};

// Of (x, y, theta) in the robot frame itself (m, m, rad), pitch and roll (rad).
using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

// The pose after a small step, given in the robot frame.
BodyPose Moved(const BodyPose& pose, const Vector5d& step);

// The step that Moved() takes from one to the other.
Vector5d StepBetween(const BodyPose& from, const BodyPose& to);

// How a fixed point of the ground, in the robot frame, seems to move over the ground, in the robot
// frame, for a small step of a body at the height `height_m`: its camera takes itself for level.
Eigen::Matrix<double, 2, 5> ApparentMotion(const Eigen::Vector2d& point, double height_m);

// What is known of the motion before the pictures are asked.
struct MotionPrior {
  BodyPose pose;
  Matrix5d information = Matrix5d::Zero();  // of the step from `pose`
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
  BodyPose pose;
  Matrix5d covariance = Matrix5d::Zero();
  bool shows_lean = false;   // the matches alone tell how the body leans
  std::vector<bool> inlier;  // one for each match
  int inliers = 0;
};

// The pose from which the matches appear where they do: hypotheses of two points each, the best by
// MSAC (Torr and Zisserman 2000), then least squares on what agrees. The pose of the prior competes
// with the hypotheses, and its information counts in the least squares; where matches are many,
// they decide. Deterministic.
PoseEstimate EstimatePose(const GroundCamera& camera, std::span<const GroundMatch> matches,
                          const MotionPrior& prior, const MotionOptions& options);

// Pixel homography that takes where a point is seen now to where it was seen before, for points on
// a plane parallel to the ground: `height_ratio` is the height of the plane over the height of the
// camera (0 for the ground; not 1). A plane that is closer to the camera moves like the ground
// under a camera that translates by 1 / (1 - height_ratio) as much. `before`, `now`: poses in the
// same frame.
Eigen::Matrix3d BeforeFromNow(const GroundCamera& camera, const BodyPose& before,
                              const BodyPose& now, double height_ratio);

// Agreement of a homography without any model (USAC with MAGSAC scoring, Barath et al. 2020) with
// one that the motion gives.
struct HomographyCheck {
  int explained = 0;         // matches that the free homography explains
  double difference_px = 0;  // median distance between the two over these, 0 if there are none
};
// `before`, `now`: pixels of the same points, as many. Four points are always explained; fewer than
// 8 check nothing, and give 0 explained.
HomographyCheck CheckHomography(std::span<const Eigen::Vector2d> before,
                                std::span<const Eigen::Vector2d> now,
                                const Eigen::Matrix3d& now_from_before, double tolerance_px);

}  // namespace beckon
