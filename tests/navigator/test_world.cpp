#include "tests/navigator/test_world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace beckon::testing {
namespace {

constexpr int kStepMs = 10;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

GroundCamera WorldCamera() {
  return GroundCamera::Pinhole(640, 480, 532.0, 0.55, RadiansFromDegrees(26.0));
}

double DistanceToSegment(const Eigen::Vector2d& point, const Wall& wall) {
  const Eigen::Vector2d edge = wall.to - wall.from;
  const double along = std::clamp((point - wall.from).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
  return (point - wall.from - along * edge).norm();
}

double RangeToDisc(const Eigen::Vector2d& from, const Eigen::Vector2d& direction,
                   const Person& person) {
  const Eigen::Vector2d offset = person.position - from;
  const double along = offset.dot(direction);
  const double beside2 = offset.squaredNorm() - along * along;
  const double half2 = person.radius_m * person.radius_m - beside2;
  return along > 0.0 && half2 > 0.0 ? std::max(0.0, along - std::sqrt(half2)) : kInfinity;
}

double Approach(double value, double target, double step) {
  return value + std::clamp(target - value, -step, step);
}

}  // namespace

NavigatorOptions TestWorld::DefaultNavigator() {
  NavigatorOptions options;
  options.robot.radius_m = 0.25;
  options.robot.centre_x_m = -0.15;
  options.robot.max_speed_mps = 0.5;
  options.robot.max_turn_radps = 1.2;
  options.robot.max_acceleration_mps2 = 0.8;
  options.robot.max_turn_acceleration_radps2 = 2.5;
  return options;
}

TestWorld::TestWorld(const FloorPlan& plan, const std::vector<Polygon>& unknown,
                     const Pose2& map_from_base, const TestWorldOptions& options,
                     const NavigatorOptions& navigator)
    : options_(options),
      robot_(navigator.robot),
      scanner_(WorldCamera(), options.faults, options.seed),
      mapper_(scanner_.caster(), OccupancyMapOptions{}),
      faces_(plan.Faces()),
      started_(clock_.Now()),
      random_(options.seed),
      navigator_(navigator, plan),
      base_(map_from_base) {
  for (const Polygon& polygon : unknown) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      faces_.push_back({polygon[i], polygon[(i + 1) % polygon.size()], std::nullopt});
    }
  }
}

double TestWorld::elapsed_s() const {
  return std::chrono::duration<double>(clock_.Now().steady - started_.steady).count();
}

void TestWorld::CallTo(const Eigen::Vector2d& point) {
  navigator_.OnCall(now(), {Call::Kind::kPoint, now().utime, "", point});
}

void TestWorld::CallByTag(const std::string& tag) {
  navigator_.OnCall(now(), {Call::Kind::kTag, now().utime, tag, Eigen::Vector2d::Zero()});
}

void TestWorld::PutTag(const std::string& tag, const Eigen::Vector2d& position, double area_90_m2) {
  std::erase_if(tags_, [&](const Tag& other) { return other.name == tag; });
  tags_.push_back({tag, position, area_90_m2});
}

bool TestWorld::RunToEnd(double seconds) {
  return Run(seconds, [&] {
    return status().state == NavigatorState::kArrived || status().state == NavigatorState::kGaveUp;
  });
}

bool TestWorld::Run(double seconds, const std::function<bool()>& done) {
  const int end = milliseconds_ + static_cast<int>(std::lround(seconds * 1e3));
  while (milliseconds_ < end) {
    if (milliseconds_ % 100 == 0) Sense();
    Deliver();
    if (milliseconds_ % 50 == 0) {
      const Velocity command = navigator_.Tick(now());
      on_command(command);
      command_ = command;
      if (done()) return true;
    }
    Move(kStepMs * 1e-3);
    milliseconds_ += kStepMs;
    clock_.Advance(std::chrono::milliseconds(kStepMs));
  }
  return done();
}

void TestWorld::Move(double step_s) {
  velocity_.linear_mps =
      Approach(velocity_.linear_mps, command_.linear_mps, robot_.max_acceleration_mps2 * step_s);
  velocity_.angular_radps = Approach(velocity_.angular_radps, command_.angular_radps,
                                     robot_.max_turn_acceleration_radps2 * step_s);
  const double way = velocity_.linear_mps * step_s;
  const double turn = velocity_.angular_radps * step_s;
  base_ = base_ * Pose2{way, 0.0, turn};
  driven_m_ += std::abs(way);
  turned_rad_ += std::abs(turn);
  const Pose2 robot_from_base = robot_.RobotFromBase();
  const Pose2 measured{way, 0.0, turn + options_.odometry_drift_rad_per_m * way};
  odometry_from_robot_ =
      odometry_from_robot_ * robot_from_base * measured * robot_from_base.Inverse();
  for (Person& person : people) person.position += step_s * person.velocity;
  closest_m_ = std::min(closest_m_, FreeSpace(base_.translation()) - robot_.radius_m);
}

double TestWorld::FreeSpace(const Eigen::Vector2d& point) const {
  double nearest = kInfinity;
  for (const Wall& face : faces_) nearest = std::min(nearest, DistanceToSegment(point, face));
  for (const Person& person : people) {
    nearest = std::min(nearest, (point - person.position).norm() - person.radius_m);
  }
  return nearest;
}

double TestWorld::Range(double bearing_rad) const {
  const Pose2 robot = base_ * robot_.RobotFromBase().Inverse();
  const double bearing = robot.theta + bearing_rad;
  const Eigen::Vector2d direction(std::cos(bearing), std::sin(bearing));
  double range = kInfinity;
  for (const Wall& face : faces_) {
    const Eigen::Vector2d edge = face.to - face.from;
    const Eigen::Vector2d offset = face.from - robot.translation();
    const double denominator = direction.x() * edge.y() - direction.y() * edge.x();
    if (std::abs(denominator) < 1e-12) continue;
    const double along = (offset.x() * edge.y() - offset.y() * edge.x()) / denominator;
    const double part = (offset.x() * direction.y() - offset.y() * direction.x()) / denominator;
    if (along >= 0.0 && part >= 0.0 && part <= 1.0) range = std::min(range, along);
  }
  for (const Person& person : people) {
    range = std::min(range, RangeToDisc(robot.translation(), direction, person));
  }
  return range;
}

void TestWorld::Sense() {
  const VirtualScan seen = scanner_.Look([this](double bearing) { return Range(bearing); });
  in_flight_.push_back({now(),
                        {now().utime, seen.first_bearing_rad, seen.bearing_step_rad, seen.ranges_m,
                         seen.ground_seen_m}});
}

void TestWorld::Deliver() {
  if (milliseconds_ % 50 == 0 && options_.has_odometry) {
    Utime utime = now().utime;
    Pose2 pose = odometry_from_robot_;
    try {
      if (tamper_odometry(utime, pose)) navigator_.OnOdometry(now(), utime, pose);
    } catch (const std::invalid_argument&) {  // as the message bus does
    }
    mapper_.motion().AddOdometry(now().utime, odometry_from_robot_);
  } else if (milliseconds_ % 50 == 0) {
    // The mapper then lives on the ground's motion, which is as exact here.
    mapper_.motion().AddOdometry(now().utime, odometry_from_robot_);
  }
  if (milliseconds_ % 100 == 0) {
    Utime utime = now().utime;
    Pose2 pose = options_.pose_bias * base_ * robot_.RobotFromBase().Inverse() *
                 Pose2{Noise(options_.pose_noise_m), Noise(options_.pose_noise_m),
                       Noise(options_.pose_noise_rad)};
    if (tamper_pose(utime, pose)) navigator_.OnPose(now(), utime, pose);
    for (const Tag& tag : tags_) {
      const double variance = tag.area_90_m2 / (std::numbers::pi * 4.605);
      navigator_.OnLocation(now(), {now().utime, tag.name, true, tag.position,
                                    variance * Eigen::Matrix2d::Identity(), tag.area_90_m2});
    }
  }
  const auto latency = std::chrono::microseconds(UtimeFromSeconds(options_.scan_latency_s));
  while (!in_flight_.empty() && now().steady - in_flight_.front().at.steady >= latency) {
    Scan scan = std::move(in_flight_.front().scan);
    in_flight_.pop_front();
    if (!tamper_scan(scan)) continue;
    mapper_.AddScan(scan.utime, {scan.first_bearing_rad, scan.bearing_step_rad, scan.ranges_m,
                                 scan.ground_seen_m});
    try {
      navigator_.OnScan(now(), std::move(scan));
    } catch (const std::invalid_argument&) {  // as the message bus does
    }
    if (mapper_.Update()) {
      const OccupancyMap& map = mapper_.map();
      GridGeometry grid;
      grid.resolution_m = map.resolution_m();
      grid.width = grid.height = map.cells();
      navigator_.OnGrid(now(), {mapper_.utime(), map.grid_from_robot(), grid, map.Occupancy()});
    }
  }
}

}  // namespace beckon::testing
