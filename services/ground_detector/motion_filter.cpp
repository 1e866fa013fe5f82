#include "services/ground_detector/motion_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr double kLeanMemoryS = 3.0;

}  // namespace

MotionFilter::MotionFilter(double max_speed_mps, double max_turn_radps,
                           const MotionFilterOptions& options)
    : max_speed_mps_(max_speed_mps), max_turn_radps_(max_turn_radps), options_(options) {
  lean_variance_ = options.first_lean_rad * options.first_lean_rad;
  Restart();
}

void MotionFilter::Restart() {
  pose_ = {};
  velocity_.setZero();
  covariance_.setZero();
  const Eigen::Vector3d sigma(max_speed_mps_, 0.3 * max_speed_mps_, max_turn_radps_);
  covariance_.bottomRightCorner<3, 3>() = sigma.cwiseAbs2().asDiagonal();
  knows_velocity_ = false;
}

double MotionFilter::lean_rad() const {
  return std::sqrt(std::max(lean_variance_, options_.least_lean_rad * options_.least_lean_rad));
}

Pose2 MotionFilter::PredictPose(double dt_s) const {
  const Eigen::Vector3d step = velocity_ * dt_s;
  return pose_ * Pose2{step.x(), step.y(), step.z()};
}

MotionFilter::Matrix6d MotionFilter::PredictCovariance(double dt_s) const {
  const Eigen::Vector3d step = velocity_ * dt_s;
  // A step of the old pose, seen from the new one.
  const double c = std::cos(step.z());
  const double s = std::sin(step.z());
  Eigen::Matrix3d carried;
  carried << c, s, -c * step.y() + s * step.x(),  //
      -s, c, s * step.y() + c * step.x(),         //
      0.0, 0.0, 1.0;
  Matrix6d transition = Matrix6d::Identity();
  transition.topLeftCorner<3, 3>() = carried;
  transition.topRightCorner<3, 3>() = dt_s * Eigen::Matrix3d::Identity();
  Matrix6d covariance = transition * covariance_ * transition.transpose();
  const Eigen::Vector3d acceleration(options_.acceleration * max_speed_mps_,
                                     options_.side_acceleration * max_speed_mps_,
                                     options_.turn_acceleration * max_turn_radps_);
  const Eigen::Matrix3d noise = acceleration.cwiseAbs2().asDiagonal();
  const double dt2 = dt_s * dt_s;
  covariance.topLeftCorner<3, 3>() += 0.25 * dt2 * dt2 * noise;
  covariance.topRightCorner<3, 3>() += 0.5 * dt2 * dt_s * noise;
  covariance.bottomLeftCorner<3, 3>() += 0.5 * dt2 * dt_s * noise;
  covariance.bottomRightCorner<3, 3>() += dt2 * noise;
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
  velocity_ += gain * Eigen::Vector3d(step.x, step.y, step.theta);
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
