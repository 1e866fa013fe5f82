// A two-wheeled base: obeys velocity commands within its limits, and counts its wheels' turns.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/frames.hpp"
#include "common/robot_file.hpp"

namespace beckon::simulation {

struct BaseOptions {
  RobotOptions robot{.radius_m = 0.25,
                     .centre_x_m = -0.15,
                     .max_speed_mps = 0.6,
                     .max_turn_radps = 1.2,
                     .max_acceleration_mps2 = 0.8,
                     .max_turn_acceleration_radps2 = 2.5};
  double command_timeout_s = 0.3;          // stops when the newest command is older
  double odometry_scale_sd = 0.01;         // of the distance, drawn once a run
  double odometry_turn_scale_sd = 0.01;    // of the angle, drawn once a run
  double odometry_drift_rad_per_m = 0.01;  // heading error per metre driven, sd, drawn once a run
  double odometry_noise = 0.02;            // of each step's motion, sd
};

class Base {
 public:
  Base(const BaseOptions& options, std::uint64_t seed, const Pose2& map_from_robot);

  // A command that has just arrived. Non-finite ones are taken as a stop.
  void Command(double linear_mps, double angular_radps);

  // Velocities that the wheels reach within this step. The motion itself may be cut short by
  // contact.
  void Accelerate(double step_s);
  // The pose after moving for the step at the present velocities.
  Pose2 Ahead(double step_s) const;
  // Moves there; `step` counts the steps of the world and picks the odometry's noise.
  void MoveTo(const Pose2& map_from_robot, std::uint64_t step);
  // Somebody lifts it and puts it down there: its wheels count nothing.
  void Carry(const Pose2& map_from_robot);
  // What a contact does.
  void Halt();

  const Pose2& map_from_robot() const { return map_from_robot_; }
  const Pose2& odometry_from_robot() const { return odometry_from_robot_; }
  double speed_mps() const { return speed_mps_; }
  double turn_radps() const { return turn_radps_; }
  double distance_driven_m() const { return distance_driven_m_; }
  Eigen::Vector2d CentreAt(const Pose2& map_from_robot) const {
    return map_from_robot * options_.robot.RobotFromBase().translation();
  }
  const BaseOptions& options() const { return options_; }

 private:
  BaseOptions options_;
  std::uint64_t seed_;
  Pose2 map_from_robot_;
  Pose2 odometry_from_robot_;
  double speed_mps_ = 0.0;
  double turn_radps_ = 0.0;
  double commanded_speed_mps_ = 0.0;
  double commanded_turn_radps_ = 0.0;
  double command_age_s_ = 1e9;
  double distance_driven_m_ = 0.0;
  double distance_scale_;
  double turn_scale_;
  double drift_rad_per_m_;
};

}  // namespace beckon::simulation
