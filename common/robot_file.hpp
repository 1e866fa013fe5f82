// The tables of a robot's file that its programs share. One file per robot, one table per program
// besides these: deploy/robots/example.toml explains every key.
#pragma once

#include <string>

#include "common/config.hpp"
#include "common/frames.hpp"

namespace beckon {

// [robot]: a body that is a disc on two driven wheels and turns about its centre. Base frame:
// origin at that centre, axes as the robot frame's.
struct RobotOptions {
  double radius_m = 0.25;   // of the disc
  double centre_x_m = 0.0;  // of the disc, robot frame; negative: the camera sits in front of it
  double max_speed_mps = 0.5;
  double max_turn_radps = 1.0;
  double max_acceleration_mps2 = 0.5;
  double max_turn_acceleration_radps2 = 2.0;

  Pose2 RobotFromBase() const { return {centre_x_m, 0.0, 0.0}; }
};
RobotOptions ReadRobotOptions(ConfigFile& file);

// [lcm] url; where it is not given, $LCM_DEFAULT_URL, and else kDefaultLcmUrl.
std::string ReadLcmUrl(ConfigFile& file);

}  // namespace beckon
