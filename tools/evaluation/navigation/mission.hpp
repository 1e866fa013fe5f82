// One mission: a random furnished flat, a robot, somebody who calls it; the libraries of the
// services called directly, faster than real time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "services/navigator/navigator.hpp"
#include "tools/evaluation/navigation/scenarios.hpp"

namespace beckon {

struct MissionOptions {
  Scenario scenario = Scenario::kFlat;
  bool use_camera =
      false;  // rendered pictures through the vision chain, else true ranges with noise
  bool use_true_pose = false;   // else rssi_localizer's, from a known start
  double odometry_error = 1.0;  // times what simulation::BaseOptions has
  double max_time_s = 400.0;
  NavigatorOptions navigator;
};
MissionOptions DefaultMissionOptions(Scenario scenario = Scenario::kFlat);

struct Mission {
  Scenario scenario = Scenario::kFlat;
  std::uint64_t seed = 0;
  // "arrived", "collided", "gave_up", "unreachable" (gave up, and rightly), "elsewhere" (says it
  // has arrived, but has not), "timeout".
  std::string outcome;
  std::string reason;  // one sentence
  double time_s = 0.0;
  double path_m = 0.0;
  double shortest_m = 0.0;  // for this footprint, to where it stopped
  double closest_m = 0.0;   // least free space around the disc
  std::string closest_to;
  double pose_error_m = 0.0;         // of the pose that the robot took for its own, at most
  double final_distance_m = 0.0;     // from the disc's centre to the caller
  std::map<std::string, int> stops;  // how often it stopped, by reason
  int reversals = 0;  // times that it steered from one side to the other while driving
  std::vector<Eigen::Vector2d> trail;  // of the disc's centre, m, map frame
  std::vector<Eigen::Vector2d> route;  // the last one planned

  double path_ratio() const {
    return shortest_m > 0.1 ? path_m / shortest_m : std::numeric_limits<double>::quiet_NaN();
  }
};

Mission RunMission(std::uint64_t seed, const MissionOptions& options);

}  // namespace beckon
