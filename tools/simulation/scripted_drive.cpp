#include "tools/simulation/scripted_drive.hpp"

#include <algorithm>
#include <cmath>

#include "tools/simulation/route.hpp"

namespace beckon::simulation {

ScriptedDrive::ScriptedDrive(const World& world)
    : map_(MakeClearanceMap(world)), passage_m_(0.33), random_(world.seed, Stream::kPlaces, 1) {}

void ScriptedDrive::PlanTo(const Eigen::Vector2d& from, const Eigen::Vector2d& goal,
                           double reach_m) {
  way_ = ShortestWay(map_, from, goal, reach_m, passage_m_);
  next_ = 1;
}

std::pair<double, double> ScriptedDrive::Command(const Simulation& simulation) {
  const RobotOptions& limits = simulation.base().options().robot;
  const Pose2 map_from_robot = simulation.truth().map_from_robot;
  const Eigen::Vector2d centre = simulation.base().CentreAt(map_from_robot);
  if (!started_) {
    PlanTo(centre, simulation.world().caller, 1.2);
    started_ = true;
  }
  if (next_ < way_.size() && (way_[next_] - centre).norm() < 0.12) ++next_;
  for (int attempt = 0; next_ >= way_.size() && attempt < 20; ++attempt) {
    const World& world = simulation.world();
    PlanTo(centre,
           {random_.Uniform(world.min.x(), world.max.x()),
            random_.Uniform(world.min.y(), world.max.y())},
           0.1);
  }
  if (next_ >= way_.size()) return {0.0, 0.0};

  const Eigen::Vector2d ahead =
      Pose2{centre.x(), centre.y(), map_from_robot.theta}.Inverse() * way_[next_];
  const double bearing = std::atan2(ahead.y(), ahead.x());
  const double turn =
      std::clamp(2.0 * bearing, -0.6 * limits.max_turn_radps, 0.6 * limits.max_turn_radps);
  double speed = std::abs(bearing) > 0.35 ? 0.0 : limits.max_speed_mps * std::cos(bearing);
  speed = std::min(speed, 0.1 + ahead.norm());
  for (const Solid& person : simulation.People()) {
    if ((person.centre - centre).norm() < person.radius + limits.radius_m + 0.5) speed = 0.0;
  }
  return {speed, turn};
}

}  // namespace beckon::simulation
