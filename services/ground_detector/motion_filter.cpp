#include "services/ground_detector/motion_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr double kLeanMemoryS = 3.0;

}  // namespace

MotionFilter::MotionFilter(const RobotOptions& robot, const MotionFilterOptions& options)
    : robot_(robot), options_(options), base_(0.0, 0.0, robot.centre_x_m) {
  covariance_(5, 5) = options.centre_sigma_m * options.centre_sigma_m;
  lean_variance_ = options.first_lean_rad * options.first_lean_rad;
  Restart();
}

void MotionFilter::Restart() {
  pose_ = {};
  base_.head<2>().setZero();
  const double centre_variance = covariance_(5, 5);
  covariance_.setZero();
  const Eigen::Vector3d variances(robot_.max_speed_mps * robot_.max_speed_mps,
                                  robot_.max_turn_radps * robot_.max_turn_radps, centre_variance);
  covariance_.bottomRightCorner<3, 3>() = variances.asDiagonal();
  knows_velocity_ = false;
}

double MotionFilter::lean_rad() const {
  return std::sqrt(std::max(lean_variance_, options_.least_lean_rad * options_.least_lean_rad));
}

// Of the origin of the robot frame, m/s, m/s, rad/s. Where it does not lie between the wheels,
// turning moves it sideways.
Eigen::Vector3d MotionFilter::FrameVelocity() const {
  return {base_.x(), -base_.z() * base_.y(), base_.y()};
}

Eigen::Matrix3d MotionFilter::FrameVelocityByBase() const {
  Eigen::Matrix3d derivative;
  derivative << 1.0, 0.0, 0.0,      //
      0.0, -base_.z(), -base_.y(),  //
      0.0, 1.0, 0.0;
  return derivative;
}

Pose2 MotionFilter::PredictPose(double dt_s) const {
  const Eigen::Vector3d step = FrameVelocity() * dt_s;
  return pose_ * Pose2{step.x(), step.y(), step.z()};
}

MotionFilter::Matrix6d MotionFilter::PredictCovariance(double dt_s) const {
  const Eigen::Vector3d step = FrameVelocity() * dt_s;
  // A step of the old pose, seen from the new one.
  const double c = std::cos(step.z());
  const double s = std::sin(step.z());
  Eigen::Matrix3d carried;
  carried << c, s, -c * step.y() + s * step.x(),  //
      -s, c, s * step.y() + c * step.x(),         //
      0.0, 0.0, 1.0;
  Matrix6d transition = Matrix6d::Identity();
  transition.topLeftCorner<3, 3>() = carried;
  transition.topRightCorner<3, 3>() = dt_s * FrameVelocityByBase();
  Matrix6d covariance = transition * covariance_ * transition.transpose();
  const Eigen::Vector2d acceleration(
      options_.acceleration * robot_.max_acceleration_mps2,
      options_.turn_acceleration * robot_.max_turn_acceleration_radps2);
  Eigen::Matrix<double, 6, 2> of_acceleration = Eigen::Matrix<double, 6, 2>::Zero();
  of_acceleration.topRows<3>() = 0.5 * dt_s * dt_s * FrameVelocityByBase().leftCols<2>();
  of_acceleration.middleRows<2>(3) = dt_s * Eigen::Matrix2d::Identity();
  covariance +=
      of_acceleration * acceleration.cwiseAbs2().asDiagonal() * of_acceleration.transpose();
  const double wheel_mps = robot_.radius_m * base_.y();
  const double speed_mps =
      std::sqrt(base_.x() * base_.x() + covariance_(3, 3) + wheel_mps * wheel_mps);
  const double slip_m = options_.side_slip * speed_mps * dt_s;
  covariance(1, 1) += slip_m * slip_m;
  return covariance;
}

MotionPrior MotionFilter::Predict(double dt_s) const {
  MotionPrior prior;
  prior.pose.frame_from_robot = PredictPose(dt_s);
  prior.information.topLeftCorner<3, 3>() =
      Eigen::Matrix3d(PredictCovariance(dt_s).topLeftCorner<3, 3>()).inverse();
  constexpr double kRigid = 1e-6;  // rad
  const double lean = options_.leans ? lean_rad() : kRigid;
  prior.information.bottomRightCorner<2, 2>() = Eigen::Matrix2d::Identity() / (lean * lean);
  return prior;
}

void MotionFilter::Update(double dt_s, const BodyPose& found, const Matrix5d& covariance,
                          bool shows_lean) {
  const Matrix6d before = PredictCovariance(dt_s);
  const Eigen::Matrix3d of_pose = before.topLeftCorner<3, 3>();
  const Eigen::Matrix3d gain = before.bottomLeftCorner<3, 3>() * of_pose.inverse();
  const Pose2 step = PredictPose(dt_s).Inverse() * found.frame_from_robot;
  const Eigen::Matrix3d posterior = covariance.topLeftCorner<3, 3>();
  base_ += gain * Eigen::Vector3d(step.x, step.y, step.theta);
  covariance_.topLeftCorner<3, 3>() = posterior;
  covariance_.bottomLeftCorner<3, 3>() = gain * posterior;
  covariance_.topRightCorner<3, 3>() = posterior * gain.transpose();
  covariance_.bottomRightCorner<3, 3>() =
      before.bottomRightCorner<3, 3>() - gain * (of_pose - posterior) * gain.transpose();
  pose_ = found.frame_from_robot;
  knows_velocity_ = true;

  // At once when it leans more than thought, and forgotten over some seconds.
  if (!shows_lean) return;
  const double square = 0.5 * (found.pitch_rad * found.pitch_rad + found.roll_rad * found.roll_rad);
  const double share = 1.0 - std::exp(-dt_s / kLeanMemoryS);
  lean_variance_ = std::max(square, lean_variance_ + share * (square - lean_variance_));
}

}  // namespace beckon
