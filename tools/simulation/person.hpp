// Somebody who walks to and fro in the flat and minds the robot.
#pragma once

#include <memory>

#include "tools/simulation/random.hpp"
#include "tools/simulation/world.hpp"

namespace beckon::simulation {

class Person {
 public:
  // `map`: where there is room to step aside. `number` picks the random choices among the world's
  // people.
  Person(const WalkingPerson& plan, const std::string& name, std::uint64_t seed,
         std::uint64_t number, std::shared_ptr<const ClearanceMap> map);

  // Walks on for a step. Stands still while the next step would come nearer to the robot than a
  // polite distance; after a while of that, makes room and comes back later. Never walks into it.
  void Step(double step_s, const Eigen::Vector2d& robot_centre, double robot_radius_m);

  Solid Body() const;
  const Eigen::Vector2d& position() const { return position_; }

 private:
  void ChooseNextWaypoint();
  void MakeRoom(const Eigen::Vector2d& robot_centre, double polite_m);
  bool CanWalkTo(const Eigen::Vector2d& point) const;

  WalkingPerson plan_;
  std::string name_;
  std::shared_ptr<const ClearanceMap> map_;
  Random random_;
  Eigen::Vector2d position_;
  Eigen::Vector2d target_;
  std::size_t waypoint_ = 1;   // the last one that was made for
  bool forth_ = true;          // towards the last waypoint
  bool has_left_way_ = false;  // target is a place to make room, not a waypoint
  double waited_s_ = 0.0;
};

}  // namespace beckon::simulation
