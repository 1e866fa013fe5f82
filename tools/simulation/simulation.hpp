// The world in motion: robot, people and radio, step by step, with the truth about all of it.
//
// Nothing here looks at a clock: one step is kStepS of the world's own time, whoever wants it and
// however fast. The same world, options and commands at the same steps give the same run.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tools/simulation/base.hpp"
#include "tools/simulation/person.hpp"
#include "tools/simulation/radio.hpp"
#include "tools/simulation/world.hpp"

namespace beckon::simulation {

inline constexpr double kStepS = 0.02;

struct Collision {
  double time_s;
  std::string with;
  Eigen::Vector2d place;  // of the footprint's centre, m, map frame
};

struct Truth {
  double time_s = 0.0;  // since the start of the world
  Pose2 map_from_robot;
  double speed_mps = 0.0;
  double turn_radps = 0.0;
  double to_caller_m = 0.0;  // from the footprint's centre
  double nearest_m =
      std::numeric_limits<double>::infinity();  // from the footprint's rim to anything, now
  double closest_m = std::numeric_limits<double>::infinity();  // the same, least so far
  std::string closest_to;
  double driven_m = 0.0;  // by the axle's middle, turns on the spot left out
  std::vector<Collision> collisions;
};

class Simulation {
 public:
  Simulation(const World& world, const BaseOptions& base, const RadioOptions& radio);

  void Command(double linear_mps, double angular_radps) {
    base_.Command(linear_mps, angular_radps);
  }

  // Somebody lifts the robot and puts it down there.
  void Carry(const Pose2& map_from_robot) {
    base_.Carry(map_from_robot);
    UpdateTruth();
  }

  // Somebody who moves as the caller of this likes, and does not mind the robot.
  void SetVisitor(const std::optional<Solid>& visitor) { visitor_ = visitor; }

  // One step on. Returns the packets that the robot's radio received in it.
  std::vector<RadioPacket> Step();

  const World& world() const { return world_; }
  const Base& base() const { return base_; }
  const Truth& truth() const { return truth_; }
  std::uint64_t steps() const { return step_; }
  std::vector<Solid> People() const;
  // True distance from the robot frame's origin to the first thing that stands, along a bearing in
  // the robot frame; infinity where there is none.
  double Range(double bearing_rad) const;

 private:
  struct Nearest {
    double distance_m;
    std::string name;
  };
  Nearest NearestTo(const Eigen::Vector2d& centre) const;
  void UpdateTruth();

  World world_;
  Base base_;
  Radio radio_;
  std::vector<Person> people_;
  std::optional<Solid> visitor_;
  std::uint64_t step_ = 0;
  Truth truth_;
  bool in_contact_ = false;
};

}  // namespace beckon::simulation
