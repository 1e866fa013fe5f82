#include "tools/simulation/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace beckon::simulation {

Simulation::Simulation(const World& world, const BaseOptions& base, const RadioOptions& radio)
    : world_(world), base_(base, world.seed, world.map_from_robot), radio_(world, radio) {
  if (!world_.people.empty()) {
    const auto map = std::make_shared<const ClearanceMap>(MakeClearanceMap(world_));
    for (const WalkingPerson& plan : world_.people) {
      const std::size_t number = people_.size() + 1;
      people_.emplace_back(plan, "person " + std::to_string(number), world_.seed, number, map);
    }
  }
  UpdateTruth();
}

Simulation::Nearest Simulation::NearestTo(const Eigen::Vector2d& centre) const {
  Nearest nearest{std::numeric_limits<double>::infinity(), ""};
  const auto consider = [&](const Solid& solid) {
    const double distance = Distance(solid, centre) - base_.options().robot.radius_m;
    if (distance < nearest.distance_m) nearest = {distance, solid.name};
  };
  for (const Solid& solid : world_.solids) consider(solid);
  for (const Solid& body : People()) consider(body);
  return nearest;
}

std::vector<RadioPacket> Simulation::Step() {
  for (Person& person : people_) {
    person.Step(kStepS, base_.CentreAt(base_.map_from_robot()), base_.options().robot.radius_m);
  }
  base_.Accelerate(kStepS);
  const Pose2 ahead = base_.Ahead(kStepS);
  const Nearest now = NearestTo(base_.CentreAt(base_.map_from_robot()));
  const Nearest then = NearestTo(base_.CentreAt(ahead));
  // Touching stops the robot. It may still move away from what it touches.
  const bool touches = then.distance_m <= 0.0 && then.distance_m < now.distance_m;
  if (touches) {
    if (!in_contact_) {
      truth_.collisions.push_back(
          {static_cast<double>(step_ + 1) * kStepS, then.name, base_.CentreAt(ahead)});
    }
    base_.Halt();
  }
  base_.MoveTo(touches ? base_.map_from_robot() : ahead, step_);
  // One contact is one collision, until the robot has come clear of it again.
  constexpr double kClearM = 0.02;
  in_contact_ = touches || (in_contact_ && now.distance_m < kClearM);
  const std::vector<RadioPacket> packets =
      radio_.Step(step_, kStepS, base_.map_from_robot().translation(), world_.caller);
  ++step_;
  UpdateTruth();
  return packets;
}

void Simulation::UpdateTruth() {
  const Eigen::Vector2d centre = base_.CentreAt(base_.map_from_robot());
  const Nearest nearest = NearestTo(centre);
  truth_.time_s = static_cast<double>(step_) * kStepS;
  truth_.map_from_robot = base_.map_from_robot();
  truth_.speed_mps = base_.speed_mps();
  truth_.turn_radps = base_.turn_radps();
  truth_.to_caller_m = (world_.caller - centre).norm();
  truth_.nearest_m = std::max(0.0, nearest.distance_m);
  if (truth_.nearest_m < truth_.closest_m) {
    truth_.closest_m = truth_.nearest_m;
    truth_.closest_to = nearest.name;
  }
  truth_.driven_m = base_.distance_driven_m();
}

std::vector<Solid> Simulation::People() const {
  std::vector<Solid> bodies;
  for (const Person& person : people_) bodies.push_back(person.Body());
  if (visitor_) bodies.push_back(*visitor_);
  return bodies;
}

double Simulation::Range(double bearing_rad) const {
  const Eigen::Vector2d origin = base_.map_from_robot().translation();
  const double bearing = base_.map_from_robot().theta + bearing_rad;
  return std::min(CastRay(world_.solids, origin, bearing), CastRay(People(), origin, bearing));
}

}  // namespace beckon::simulation
