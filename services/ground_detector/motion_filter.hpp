// What is known of the motion from one frame to the next: a Kalman filter with constant velocity,
// for a body on two driven wheels, which cannot go sideways.
#pragma once

#include <Eigen/Core>

#include "common/robot_file.hpp"
#include "services/ground_detector/motion.hpp"

namespace beckon {

struct MotionFilterOptions {
  // Standard deviation of accelerations, over the greatest: mostly a robot drives evenly.
  double acceleration = 0.5;
  double turn_acceleration = 0.75;
  // Standard deviation of the speed at which the base slips sideways, over its speed. On plain
  // floors, where turning and going sideways look nearly the same, this decides.
  double side_slip = 0.02;
  // Standard deviation of the robot's centre_x_m, m: where between camera and wheels the body turns
  // is learnt as far as it shows.
  double centre_sigma_m = 0.03;
  // Of the lean: at first, and the least that it is ever taken for. Else it is what the ground has
  // shown lately.
  double first_lean_rad = 0.002;
  double least_lean_rad = 0.0005;
  bool leans = true;  // else pitch and roll are 0
};

class MotionFilter {
 public:
  MotionFilter(const RobotOptions& robot, const MotionFilterOptions& options);

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
  Eigen::Vector3d FrameVelocity() const;
  Eigen::Matrix3d FrameVelocityByBase() const;
  Matrix6d PredictCovariance(double dt_s) const;
  Pose2 PredictPose(double dt_s) const;

  RobotOptions robot_;
  MotionFilterOptions options_;
  Pose2 pose_;
  // Of the base: speed forwards, m/s, rate of turn, rad/s, and centre_x_m.
  Eigen::Vector3d base_;
  Matrix6d covariance_;  // of a step of the pose, in the robot frame, and of the base
  bool knows_velocity_ = false;
  double lean_variance_ = 0.0;
};

}  // namespace beckon
