// Drives a simulated robot with full knowledge of the world, to record sequences and to test what
// needs a robot that moves.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "tools/simulation/random.hpp"
#include "tools/simulation/simulation.hpp"

namespace beckon::simulation {

class ScriptedDrive {
 public:
  explicit ScriptedDrive(const World& world);

  // Velocity command (m/s, rad/s) that follows the shortest way to the caller, and from there to
  // one random place after another. Stands still while a person is in the way.
  std::pair<double, double> Command(const Simulation& simulation);

 private:
  void PlanTo(const Eigen::Vector2d& from, const Eigen::Vector2d& goal, double reach_m);

  ClearanceMap map_;
  double passage_m_;  // radius for which ways are planned
  Random random_;
  std::vector<Eigen::Vector2d> way_;
  std::size_t next_ = 0;
  bool started_ = false;
};

}  // namespace beckon::simulation
