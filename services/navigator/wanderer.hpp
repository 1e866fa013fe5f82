// Where to drive while the robot does not know where it is on the map: into free floor, to see
// more.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/navigator/surroundings.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

class Wanderer {
 public:
  // `margin_m`: kept free around the disc.
  Wanderer(const RobotOptions& robot, double margin_m) : robot_(robot), margin_m_(margin_m) {}

  // Forgets where it has been.
  void Clear() { been_.clear(); }

  // A point (local frame) to be reached in a straight line over floor that was seen and is free: of
  // all directions, that which leads farthest from where it has been. Nothing where no direction
  // leads anywhere.
  std::optional<Eigen::Vector2d> NextPlace(const Pose2& local_from_base,
                                           const Surroundings& surroundings);

 private:
  RobotOptions robot_;
  double margin_m_;
  std::vector<Eigen::Vector2d> been_;  // places it has been at or made for, local frame
};

}  // namespace beckon
