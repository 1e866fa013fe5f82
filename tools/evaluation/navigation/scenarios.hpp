// Where missions take place.
#pragma once

#include <cstdint>
#include <optional>

#include "tools/simulation/simulation.hpp"

namespace beckon {

enum class Scenario {
  kFlat,    // a random furnished flat, 1 to 6 rooms, up to 3 people who walk; called by a tag
  kDemo,    // the flat that tools/demo shows with this seed, called by a tag as there
  kDoor,    // through a door of 0.8 m, with odd seeds from left to right, with even ones back
  kStepIn,  // along a hall at 0.5 m/s; somebody steps in 1.5 m before it, and stays there
};

simulation::World ScenarioWorld(Scenario scenario, std::uint64_t seed);

// Who steps in. Does not mind the robot.
class Visitor {
 public:
  Visitor(std::uint64_t seed, double robot_radius_m);
  // The body, where there is one at this time; comes when the robot drives at speed.
  std::optional<simulation::Solid> At(const simulation::Truth& truth,
                                      const Eigen::Vector2d& robot_centre);

 private:
  double robot_radius_m_;
  double start_x_m_;  // where the robot is when the visitor comes
  double side_;       // +1: from the left
  double speed_mps_;
  struct Entry {
    double time_s;
    double x_m;
  };
  std::optional<Entry> entry_;
};

}  // namespace beckon
