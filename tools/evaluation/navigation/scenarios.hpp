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
  // Along the same hall; called off on the way, it stands while somebody steps up to it, and is
  // called again with him there.
  kStepInStanding,
};

simulation::World ScenarioWorld(Scenario scenario, std::uint64_t seed);

// Who steps in. Does not mind the robot.
class Visitor {
 public:
  // For Scenario::kStepIn or kStepInStanding.
  Visitor(Scenario scenario, std::uint64_t seed, double robot_radius_m);
  // The body, where there is one at this time. Comes when the robot has gone far enough, and drives
  // at speed or stands, as the scenario has it.
  std::optional<simulation::Solid> At(const simulation::Truth& truth,
                                      const Eigen::Vector2d& robot_centre);

  // Where he waits for the robot, m along the hall.
  double start_x_m() const { return start_x_m_; }
  // Whether he stands where he wanted to.
  bool has_come(double time_s) const;

 private:
  struct Walk {
    double start_s;
    Eigen::Vector2d from;
    Eigen::Vector2d to;
  };
  Walk IntoTheWay(const simulation::Truth& truth, const Eigen::Vector2d& robot_centre) const;
  Walk UpTo(const simulation::Truth& truth, const Eigen::Vector2d& robot_centre) const;

  Scenario scenario_;
  double robot_radius_m_;
  double start_x_m_;
  double side_;  // +1: from the left
  double speed_mps_;
  double gap_m_;        // kStepInStanding: between the bodies in the end
  double bearing_rad_;  // from the robot, which looks along the hall or about there
  std::optional<Walk> walk_;
};

}  // namespace beckon
