#include "tools/simulation/person.hpp"

#include <stdexcept>

namespace beckon::simulation {
namespace {

constexpr double kPoliteM = 0.6;    // free between a person and the robot
constexpr double kPatienceS = 3.0;  // standing before the robot, until the person turns back

}  // namespace

Person::Person(const WalkingPerson& plan, const std::string& name)
    : plan_(plan), name_(name), position_(plan.waypoints.at(0)) {
  if (plan_.waypoints.size() < 2) throw std::invalid_argument("a walk needs two waypoints");
}

void Person::Step(double step_s, const Eigen::Vector2d& robot_centre, double robot_radius_m) {
  const Eigen::Vector2d to_go = plan_.waypoints[next_] - position_;
  const double stride = plan_.speed_mps * step_s;
  const bool arrives = to_go.norm() <= stride;
  const Eigen::Vector2d ahead =
      arrives ? plan_.waypoints[next_] : position_ + to_go.normalized() * stride;
  const double distance = (ahead - robot_centre).norm();
  const bool comes_nearer = distance < (position_ - robot_centre).norm();
  if (comes_nearer && distance < robot_radius_m + kPersonRadiusM + kPoliteM) {
    waited_s_ += step_s;
    if (waited_s_ > kPatienceS) TurnRound();
    return;
  }
  waited_s_ = 0.0;
  position_ = ahead;
  if (!arrives) return;
  if (forth_ ? next_ + 1 == plan_.waypoints.size() : next_ == 0) forth_ = !forth_;
  next_ = forth_ ? next_ + 1 : next_ - 1;
}

void Person::TurnRound() {
  waited_s_ = 0.0;
  forth_ = !forth_;
  next_ = forth_ ? next_ + 1 : next_ - 1;
}

Solid Person::Body() const {
  return MakeCylinder(name_, SolidKind::kPerson, position_, kPersonRadiusM, kPersonHeightM);
}

}  // namespace beckon::simulation
