#include "tools/simulation/base.hpp"

#include <algorithm>
#include <cmath>

#include "tools/simulation/random.hpp"

namespace beckon::simulation {
namespace {

double Approach(double value, double target, double largest_change) {
  return value + std::clamp(target - value, -largest_change, largest_change);
}

}  // namespace

Base::Base(const BaseOptions& options, std::uint64_t seed, const Pose2& map_from_robot)
    : options_(options),
      seed_(seed),
      map_from_robot_(map_from_robot),
      odometry_from_robot_(map_from_robot) {
  Random random(seed, Stream::kOdometry);
  distance_scale_ = 1.0 + options_.odometry_scale_sd * random.Normal();
  turn_scale_ = 1.0 + options_.odometry_turn_scale_sd * random.Normal();
  drift_rad_per_m_ = options_.odometry_drift_rad_per_m * random.Normal();
}

void Base::Command(double linear_mps, double angular_radps) {
  const bool usable = std::isfinite(linear_mps) && std::isfinite(angular_radps);
  commanded_speed_mps_ =
      usable ? std::clamp(linear_mps, -options_.robot.max_speed_mps, options_.robot.max_speed_mps)
             : 0.0;
  commanded_turn_radps_ = usable ? std::clamp(angular_radps, -options_.robot.max_turn_radps,
                                              options_.robot.max_turn_radps)
                                 : 0.0;
  command_age_s_ = 0.0;
}

void Base::Accelerate(double step_s) {
  command_age_s_ += step_s;
  const bool fresh = command_age_s_ <= options_.command_timeout_s;
  speed_mps_ = Approach(speed_mps_, fresh ? commanded_speed_mps_ : 0.0,
                        options_.robot.max_acceleration_mps2 * step_s);
  turn_radps_ = Approach(turn_radps_, fresh ? commanded_turn_radps_ : 0.0,
                         options_.robot.max_turn_acceleration_radps2 * step_s);
}

Pose2 Base::Ahead(double step_s) const {
  // The axle's middle moves along a circle; the robot frame's origin is ahead of it.
  const double turn = turn_radps_ * step_s;
  const double distance = speed_mps_ * step_s;
  const Pose2 robot_from_axle = options_.robot.RobotFromBase();
  const Pose2 moved{distance * std::cos(0.5 * turn), distance * std::sin(0.5 * turn), turn};
  return map_from_robot_ * robot_from_axle * moved * robot_from_axle.Inverse();
}

void Base::MoveTo(const Pose2& map_from_robot, std::uint64_t step) {
  const Pose2 robot_from_axle = options_.robot.RobotFromBase();
  const Pose2 axle_motion =
      robot_from_axle.Inverse() * map_from_robot_.Inverse() * map_from_robot * robot_from_axle;
  const double distance = std::copysign(axle_motion.translation().norm(), axle_motion.x);
  distance_driven_m_ += std::abs(distance);

  Random random(seed_, Stream::kOdometry, step + 1);
  const double measured = distance * (distance_scale_ + options_.odometry_noise * random.Normal());
  const double turned =
      axle_motion.theta * (turn_scale_ + options_.odometry_noise * random.Normal()) +
      drift_rad_per_m_ * std::abs(distance);
  const Pose2 counted{measured * std::cos(0.5 * turned), measured * std::sin(0.5 * turned), turned};
  odometry_from_robot_ =
      odometry_from_robot_ * robot_from_axle * counted * robot_from_axle.Inverse();
  map_from_robot_ = map_from_robot;
}

void Base::Carry(const Pose2& map_from_robot) {
  Halt();
  map_from_robot_ = map_from_robot;
}

void Base::Halt() {
  speed_mps_ = 0.0;
  turn_radps_ = 0.0;
}

}  // namespace beckon::simulation
