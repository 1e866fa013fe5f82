#include "tools/evaluation/navigation/scenarios.hpp"

#include <cmath>

#include "tools/simulation/random.hpp"
#include "tools/simulation/solids.hpp"

namespace beckon {
namespace {

using simulation::Random;
using simulation::Solid;
using simulation::Stream;
using simulation::World;

constexpr double kHallLengthM = 10.0;
constexpr double kHallWidthM = 4.0;
constexpr double kMiddleM = 0.5 * kHallWidthM;
constexpr double kWallM = 0.1;

void AddBox(const Eigen::Vector2d& min, const Eigen::Vector2d& max, World& world) {
  const Eigen::Vector2d middle = 0.5 * (min + max);
  world.solids.push_back(simulation::MakeBox(
      "wall " + std::to_string(world.solids.size() + 1), simulation::SolidKind::kWall,
      {middle.x(), middle.y(), 0.0}, max - min, simulation::kWallHeightM));
}

World Hall(std::uint64_t seed) {
  World world;
  world.seed = seed;
  world.max = {kHallLengthM, kHallWidthM};
  AddBox({-kWallM, -kWallM}, {kHallLengthM + kWallM, 0.0}, world);
  AddBox({-kWallM, kHallWidthM}, {kHallLengthM + kWallM, kHallWidthM + kWallM}, world);
  AddBox({-kWallM, 0.0}, {0.0, kHallWidthM}, world);
  AddBox({kHallLengthM, 0.0}, {kHallLengthM + kWallM, kHallWidthM}, world);
  world.rooms.push_back({world.min, world.max});  // where lamps hang
  world.inner_wall_thickness_m = kWallM;
  const char* const names[] = {"0001", "0002", "0003", "0004"};
  for (int i = 0; i < 4; ++i) {
    world.beacons.push_back({names[i], {i % 2 == 0 ? 0.1 : 9.9, i < 2 ? 0.1 : 3.9, 2.0}});
  }
  return world;
}

// The pose of the robot frame for a footprint that stands here.
Pose2 RobotAt(const Eigen::Vector2d& centre, double heading_rad) {
  const RobotOptions robot = simulation::BaseOptions{}.robot;
  return Pose2{centre.x(), centre.y(), heading_rad} * robot.RobotFromBase().Inverse();
}

World DoorWorld(std::uint64_t seed) {
  constexpr double kDoorM = 0.8;
  World world = Hall(seed);
  Random random(seed, Stream::kPlaces);
  const double x = 0.5 * kHallLengthM;
  const double y = random.Uniform(0.8, kHallWidthM - 0.8);
  for (const bool is_lower : {true, false}) {
    const Eigen::Vector2d from(x, is_lower ? 0.0 : y + 0.5 * kDoorM);
    const Eigen::Vector2d to(x, is_lower ? y - 0.5 * kDoorM : kHallWidthM);
    const Eigen::Vector2d half(0.5 * kWallM, 0.0);
    AddBox(from - half, to + half, world);
    world.inner_walls.push_back({from, to, std::nullopt});
  }
  world.doors.push_back({{x, y}, kDoorM});
  const bool is_back = seed % 2 == 0;
  const Eigen::Vector2d left = random.UniformIn({0.8, 0.6}, {3.8, kHallWidthM - 0.6});
  const Eigen::Vector2d right = random.UniformIn({6.2, 0.6}, {9.2, kHallWidthM - 0.6});
  world.map_from_robot =
      RobotAt(is_back ? right : left, random.Uniform(-std::numbers::pi, std::numbers::pi));
  world.caller = is_back ? left : right;
  return world;
}

World StepInWorld(std::uint64_t seed) {
  World world = Hall(seed);
  world.map_from_robot = RobotAt({0.8, kMiddleM}, 0.0);
  world.caller = {kHallLengthM - 1.0, kMiddleM};
  return world;
}

World Flat(std::uint64_t seed) {
  simulation::WorldOptions options;
  options.min_rooms = 1;
  options.max_rooms = 6;
  options.min_furniture = 0;
  options.max_furniture = 10;
  options.walking_people = static_cast<int>(seed % 4);
  return simulation::MakeWorld(seed, options);
}

}  // namespace

World ScenarioWorld(Scenario scenario, std::uint64_t seed) {
  switch (scenario) {
    case Scenario::kDoor:
      return DoorWorld(seed);
    case Scenario::kStepIn:
    case Scenario::kStepInStanding:
      return StepInWorld(seed);
    case Scenario::kDemo:
      return simulation::MakeWorld(seed, {});
    case Scenario::kFlat:
      break;
  }
  return Flat(seed);
}

Visitor::Visitor(Scenario scenario, std::uint64_t seed, double robot_radius_m)
    : scenario_(scenario), robot_radius_m_(robot_radius_m) {
  Random random(seed, Stream::kPeople);
  start_x_m_ = random.Uniform(2.5, 6.0);
  side_ = random.Chance(0.5) ? 1.0 : -1.0;
  speed_mps_ = random.Uniform(0.8, 1.6);
  gap_m_ = random.Uniform(0.03, 0.6);
  bearing_rad_ = random.Uniform(-1.4, 1.4);
}

Visitor::Walk Visitor::IntoTheWay(const simulation::Truth& truth,
                                  const Eigen::Vector2d& robot_centre) const {
  constexpr double kAheadM = 1.5;  // of the robot's rim, to the body
  constexpr double kFromM = 1.0;   // aside of the robot's way
  const double x = robot_centre.x() + robot_radius_m_ + kAheadM + simulation::kPersonRadiusM;
  return {truth.time_s, {x, kMiddleM + side_ * kFromM}, {x, kMiddleM}};
}

Visitor::Walk Visitor::UpTo(const simulation::Truth& truth,
                            const Eigen::Vector2d& robot_centre) const {
  constexpr double kWalkM = 0.9;  // begins within the hall
  const double heading = truth.map_from_robot.theta + bearing_rad_;
  const Eigen::Vector2d direction(std::cos(heading), std::sin(heading));
  const double away_m = robot_radius_m_ + gap_m_ + simulation::kPersonRadiusM;
  return {truth.time_s, robot_centre + (away_m + kWalkM) * direction,
          robot_centre + away_m * direction};
}

std::optional<Solid> Visitor::At(const simulation::Truth& truth,
                                 const Eigen::Vector2d& robot_centre) {
  constexpr double kAtSpeedMps = 0.45;
  const bool is_far_enough = robot_centre.x() > start_x_m_;
  if (!walk_ && is_far_enough && scenario_ == Scenario::kStepIn && truth.speed_mps > kAtSpeedMps) {
    walk_ = IntoTheWay(truth, robot_centre);
  }
  if (!walk_ && is_far_enough && scenario_ == Scenario::kStepInStanding && truth.speed_mps == 0.0 &&
      truth.turn_radps == 0.0) {
    walk_ = UpTo(truth, robot_centre);
  }
  if (!walk_) return std::nullopt;
  const Eigen::Vector2d way = walk_->to - walk_->from;
  const double walked_m = std::min(way.norm(), speed_mps_ * (truth.time_s - walk_->start_s));
  return simulation::MakeCylinder("visitor", simulation::SolidKind::kPerson,
                                  walk_->from + walked_m * way.normalized(),
                                  simulation::kPersonRadiusM, simulation::kPersonHeightM);
}

bool Visitor::has_come(double time_s) const {
  return walk_ && speed_mps_ * (time_s - walk_->start_s) > (walk_->to - walk_->from).norm();
}

}  // namespace beckon
