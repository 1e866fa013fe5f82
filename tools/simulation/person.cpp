#include "tools/simulation/person.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace beckon::simulation {
namespace {

constexpr double kPoliteM = 0.6;    // free between a person and the robot
constexpr double kPatienceS = 3.0;  // standing before the robot, until the person makes room
constexpr double kFreeM = 0.05;     // between a person and the furniture, at least

}  // namespace

Person::Person(const WalkingPerson& plan, const std::string& name, std::uint64_t seed,
               std::uint64_t number, std::shared_ptr<const ClearanceMap> map)
    : plan_(plan),
      name_(name),
      map_(std::move(map)),
      random_(seed, Stream::kPeople, 1000 + number) {
  if (plan_.waypoints.size() < 2) throw std::invalid_argument("a walk needs two waypoints");
  position_ = plan_.waypoints[0];
  target_ = plan_.waypoints[1];
}

void Person::Step(double step_s, const Eigen::Vector2d& robot_centre, double robot_radius_m) {
  const double polite_m = robot_radius_m + kPersonRadiusM + kPoliteM;
  const Eigen::Vector2d to_go = target_ - position_;
  const double stride = plan_.speed_mps * step_s;
  const bool arrives = to_go.norm() <= stride;
  const Eigen::Vector2d ahead = arrives ? target_ : position_ + to_go.normalized() * stride;
  const double distance = (ahead - robot_centre).norm();
  if (distance < polite_m && distance <= (position_ - robot_centre).norm()) {
    waited_s_ += step_s;
    if (waited_s_ > kPatienceS) MakeRoom(robot_centre, polite_m);
    return;
  }
  waited_s_ = 0.0;
  position_ = ahead;
  if (arrives) ChooseNextWaypoint();
}

bool Person::CanWalkTo(const Eigen::Vector2d& point) const {
  return map_->LineIsFree(position_, point, kPersonRadiusM + kFreeM);
}

void Person::ChooseNextWaypoint() {
  if (has_left_way_) {
    // Back to the walk where it can be joined in a straight line; until then from one free place to
    // another.
    for (std::size_t i = 0; i < plan_.waypoints.size(); ++i) {
      if (!CanWalkTo(plan_.waypoints[i])) continue;
      waypoint_ = i;
      target_ = plan_.waypoints[i];
      has_left_way_ = false;
      return;
    }
    MakeRoom(position_, 0.0);
    return;
  }
  if (forth_ ? waypoint_ + 1 == plan_.waypoints.size() : waypoint_ == 0) forth_ = !forth_;
  waypoint_ = forth_ ? waypoint_ + 1 : waypoint_ - 1;
  target_ = plan_.waypoints[waypoint_];
}

// Of some places in a straight line from here, the one farthest from the robot, without coming
// nearer to it on the way.
void Person::MakeRoom(const Eigen::Vector2d& robot_centre, double polite_m) {
  constexpr int kTries = 60;
  constexpr double kReachM = 3.0;
  waited_s_ = 0.0;
  double best_m = 0.0;
  for (int i = 0; i < kTries; ++i) {
    const double angle = random_.Uniform(-std::numbers::pi, std::numbers::pi);
    const double reach = random_.Uniform(0.3, kReachM);
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d place = position_ + reach * direction;
    const Eigen::Vector2d from_robot = position_ - robot_centre;
    // The nearest that the line comes to the robot is at its start, or on the way when it leads
    // there.
    const double along = std::clamp(-from_robot.dot(direction), 0.0, reach);
    if (along > 0.0 && (from_robot + along * direction).norm() < polite_m) continue;
    const double away_m = (place - robot_centre).norm();
    if (away_m <= best_m || !CanWalkTo(place)) continue;
    best_m = away_m;
    target_ = place;
    has_left_way_ = true;
  }
}

Solid Person::Body() const {
  return MakeCylinder(name_, SolidKind::kPerson, position_, kPersonRadiusM, kPersonHeightM);
}

}  // namespace beckon::simulation
