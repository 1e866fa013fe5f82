#include "services/navigator/path_follower.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/navigator/stop_reasons.hpp"

namespace beckon {
namespace {

constexpr double kViewM = 2.0;      // of the arc that is looked at
constexpr double kNearM = 0.6;      // of it, where obstacles beside the way slow the robot down
constexpr double kCreepMps = 0.05;  // slower than this is standing
constexpr double kTurnDoneRad = 0.12;
constexpr double kTurnWhenStuckRad = 0.15;
constexpr double kLookaheadStepM = 0.15;
constexpr double kBraking = 0.7;  // share of the deceleration that is planned with
constexpr double kTurning = 0.8;  // share of the turn rate that is planned with

}  // namespace

void ReadFollowerOptions(ConfigTable& table, FollowerOptions& options) {
  table.Optional("min_lookahead_m", options.min_lookahead_m, Range{0.05, 5.0});
  table.Optional("max_lookahead_m", options.max_lookahead_m, Range{0.1, 5.0});
  table.Optional("turn_in_place_rad", options.turn_in_place_rad, Range{0.2, 3.0});
  table.Optional("scan_turn_radps", options.scan_turn_radps, Range{0.05, 10.0});
  table.Optional("follow_margin_m", options.margin_m, Range{0.0, 1.0});
}

PathFollower::Projection PathFollower::Project(const std::vector<Eigen::Vector2d>& route,
                                               const Eigen::Vector2d& point) {
  Projection best{0, 0.0, 0.0};
  double least = std::numeric_limits<double>::infinity();
  double length_before = 0.0;
  double at = 0.0;
  for (std::size_t i = 0; i + 1 < route.size(); ++i) {
    const Eigen::Vector2d edge = route[i + 1] - route[i];
    const double length = edge.norm();
    const double along =
        length > 0.0 ? std::clamp((point - route[i]).dot(edge) / length, 0.0, length) : 0.0;
    const double distance =
        (route[i] + (length > 0.0 ? along / length : 0.0) * edge - point).norm();
    // Later parts of the route may pass nearby: they have to be clearly nearer.
    if (distance < least - 0.05) {
      least = distance;
      best.segment = i;
      best.along_m = along;
      at = length_before + along;
    }
    length_before += length;
  }
  best.remaining_m = length_before - at;
  return best;
}

Eigen::Vector2d PathFollower::Ahead(const std::vector<Eigen::Vector2d>& route,
                                    const Projection& from, double distance_m) {
  double left = from.along_m + distance_m;
  for (std::size_t i = from.segment; i + 1 < route.size(); ++i) {
    const Eigen::Vector2d edge = route[i + 1] - route[i];
    const double length = edge.norm();
    if (left <= length) return length > 0.0 ? route[i] + left / length * edge : route[i];
    left -= length;
  }
  return route.back();
}

Eigen::Vector2d PathFollower::Lookahead(const std::vector<Eigen::Vector2d>& route,
                                        const Projection& from, const Pose2& local_from_base,
                                        const Surroundings& surroundings) const {
  const Eigen::Vector2d base = local_from_base.translation();
  const double needed =
      std::min(robot_.radius_m + options_.margin_m, surroundings.Clearance(base) - 0.01);
  for (double distance = options_.max_lookahead_m; distance > options_.min_lookahead_m;
       distance -= kLookaheadStepM) {
    const Eigen::Vector2d target = Ahead(route, from, distance);
    const int steps = static_cast<int>(std::ceil((target - base).norm() / 0.05));
    bool is_free = true;
    for (int i = 1; i <= steps && is_free; ++i) {
      is_free = surroundings.Clearance(base + (target - base) * (static_cast<double>(i) / steps)) >=
                needed;
    }
    if (is_free) return target;
  }
  return Ahead(route, from, options_.min_lookahead_m);
}

double PathFollower::SpeedToStopWithin(double distance_m) const {
  if (distance_m <= 0.0) return 0.0;
  const double a = kBraking * robot_.max_acceleration_mps2;
  const double t = options_.reaction_s;
  return a * (std::sqrt(t * t + 2.0 * distance_m / a) - t);
}

double PathFollower::TurnRate(double angle_rad) const {
  const double braking =
      std::sqrt(2.0 * kBraking * robot_.max_turn_acceleration_radps2 * std::abs(angle_rad));
  const double fastest = std::min(options_.scan_turn_radps, kTurning * robot_.max_turn_radps);
  return std::copysign(std::min({fastest, braking, 2.5 * std::abs(angle_rad)}), angle_rad);
}

Step PathFollower::Follow(const std::vector<Eigen::Vector2d>& route, const Pose2& local_from_base,
                          const Surroundings& surroundings) {
  Step step;
  const Projection here = Project(route, local_from_base.translation());
  const Eigen::Vector2d target = Lookahead(route, here, local_from_base, surroundings);
  const Eigen::Vector2d ahead = local_from_base.Inverse() * target;
  step.distance_to_go_m =
      here.remaining_m + (Ahead(route, here, 0.0) - local_from_base.translation()).norm();

  const double heading_error = std::atan2(ahead.y(), ahead.x());
  is_turning_ = std::abs(heading_error) > (is_turning_ ? kTurnDoneRad : options_.turn_in_place_rad);
  if (is_turning_) {
    step.velocity.angular_radps = TurnRate(heading_error);
    return step;
  }

  const double curvature = 2.0 * ahead.y() / std::max(1e-3, ahead.squaredNorm());
  const ArcView view =
      LookAlong(surroundings, robot_, local_from_base, curvature, 1, kViewM, options_.margin_m);
  const ArcView nearby =
      LookAlong(surroundings, robot_, local_from_base, curvature, 1, kNearM, options_.margin_m);
  double speed = robot_.max_speed_mps;
  speed = std::min(speed, kTurning * robot_.max_turn_radps / std::max(1e-3, std::abs(curvature)));
  speed = std::min(speed, 0.15 + 2.0 * std::max(0.0, nearby.clearance_m));
  speed = std::min(speed, SpeedToStopWithin(step.distance_to_go_m) + kCreepMps);
  const double to_obstacle = SpeedToStopWithin(view.free_m - options_.margin_m);
  const double to_unseen = SpeedToStopWithin(view.seen_m - options_.margin_m);
  speed = std::min({speed, to_obstacle, to_unseen});

  if (speed < kCreepMps) {
    // What is ahead of the nose is not what is ahead on the route: look there first.
    if (std::abs(heading_error) > kTurnWhenStuckRad) {
      is_turning_ = true;
      step.velocity.angular_radps = TurnRate(heading_error);
    } else {
      step.blocked_by =
          to_obstacle <= to_unseen ? stop_reason::kObstacle : stop_reason::kGroundNotSeen;
    }
    return step;
  }
  step.velocity = {speed, speed * curvature};
  return step;
}

}  // namespace beckon
