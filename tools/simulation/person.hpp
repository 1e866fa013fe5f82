// Somebody who walks to and fro in the flat and minds the robot.
#pragma once

#include "tools/simulation/world.hpp"

namespace beckon::simulation {

class Person {
 public:
  Person(const WalkingPerson& plan, const std::string& name);

  // Walks on for a step. Stands still while the next step would come nearer to the robot than a
  // polite distance; after a while of that, turns back. Never walks into it.
  void Step(double step_s, const Eigen::Vector2d& robot_centre, double robot_radius_m);

  Solid Body() const;
  const Eigen::Vector2d& position() const { return position_; }

 private:
  void TurnRound();

  WalkingPerson plan_;
  std::string name_;
  Eigen::Vector2d position_;
  std::size_t next_ = 1;  // waypoint that is walked to
  bool forth_ = true;     // towards the last waypoint
  double waited_s_ = 0.0;
};

}  // namespace beckon::simulation
