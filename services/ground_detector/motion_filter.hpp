// What is known of the motion from one frame to the next: a Kalman filter with constant velocity.
#pragma once

#include <Eigen/Core>

#include "services/ground_detector/motion.hpp"

namespace beckon {

struct MotionFilterOptions {
  // Standard deviations of what a robot does within a second, over its greatest speeds.
  double acceleration = 0.5;       // along x
  double side_acceleration = 0.2;  // along y
  double turn_acceleration = 1.0;
  // Of the lean: at first, and the least that it is ever taken for. Else it is what the ground has
  // shown lately.
  double first_lean_rad = 0.002;
  double least_lean_rad = 0.0005;
  bool leans = true;  // else pitch and roll are 0
};

class MotionFilter {
 public:
  MotionFilter(double max_speed_mps, double max_turn_radps, const MotionFilterOptions& options);

  // Where the robot may be `dt_s` after the last update.
  MotionPrior Predict(double dt_s) const;
  // The pose found `dt_s` after the last one, with the covariance of its step, in which the prior
  // for that time has its part. `shows_lean`: there was enough to see that its lean can be
  // believed.
  void Update(double dt_s, const BodyPose& found, const Matrix5d& covariance, bool shows_lean);
  // At the origin, at a velocity that can be anything.
  void Restart();

  bool knows_velocity() const { return knows_velocity_; }
  // Standard deviation that lean is expected to have.
  double lean_rad() const;

 private:
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  Matrix6d PredictCovariance(double dt_s) const;
  Pose2 PredictPose(double dt_s) const;

  double max_speed_mps_;
  double max_turn_radps_;
  MotionFilterOptions options_;
  Pose2 pose_;
  Eigen::Vector3d velocity_;  // in the robot frame, m/s, m/s, rad/s
  Matrix6d covariance_;       // of a step of the pose, in the robot frame, and of the velocity
  bool knows_velocity_ = false;
  double lean_variance_ = 0.0;
};

}  // namespace beckon
