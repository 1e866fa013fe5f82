#include "services/navigator/path_follower.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "services/navigator/stop_reasons.hpp"

namespace beckon {
namespace {

constexpr double kViewM = 2.0;  // of the arc that is looked at
constexpr double kNearM = 0.6;  // of it, where obstacles beside the way slow the robot down
// Speed beside things: so much where it all but touches, and more with every metre of room.
constexpr double kNarrowMps = 0.10;
constexpr double kMpsPerM = 2.0;
// Beside somebody who walks the robot is the slower one: it does not overtake him out of its sight.
constexpr double kBesideM = 1.0;  // from its rim
constexpr double kBesideMps = 0.3;
constexpr double kCreepMps = 0.05;  // slower than this is standing
constexpr double kTurnDoneRad = 0.12;
constexpr double kTurnWhenStuckRad = 0.15;
constexpr double kLookaheadStepM = 0.05;
constexpr double kAmpleM = 0.25;   // free space that is as good as any more
constexpr double kDetourM = 0.25;  // an arc blocked nearer than this is left for another one
// Looking aside.
constexpr double kFacedRad = 0.1;
constexpr double kBeyondRad = 2.0 * kTurnDoneRad;  // once turned back, it may face this far off
constexpr double kLookS = 0.6;                     // for a picture of it to arrive
constexpr double kSamePlaceM = 0.25;  // a look nearer than this to one in vain is in vain too
constexpr double kVainS = 10.0;       // for so long
constexpr double kBraking = 0.7;      // share of the deceleration that is planned with
constexpr double kTurning = 0.8;      // share of the turn rate that is planned with

// Farther aside by kBeyondRad: what is seen there has to do for the way that the robot then takes.
Eigen::Vector2d Beyond(const Eigen::Vector2d& point, const Pose2& local_from_base) {
  const Eigen::Vector2d place = local_from_base.Inverse() * point;
  return local_from_base * (Eigen::Rotation2Dd(std::copysign(kBeyondRad, place.y())) * place);
}

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
  // The straight line to the target comes no nearer to things than the route does on the way
  // there, except where there is ample room.
  constexpr double kEaseM = 0.02;
  double needed = std::min(robot_.radius_m + kAmpleM, surroundings.Clearance(base));
  Eigen::Vector2d best = Ahead(route, from, options_.min_lookahead_m);
  double target_m = 0.0;
  while ((target_m += kLookaheadStepM) <= options_.max_lookahead_m) {
    const Eigen::Vector2d target = Ahead(route, from, target_m);
    needed = std::min(needed, surroundings.Clearance(target));
    if (target_m <= options_.min_lookahead_m) continue;
    const int steps = static_cast<int>(std::ceil((target - base).norm() / kLookaheadStepM));
    bool is_clear = true;
    for (int i = 1; i < steps && is_clear; ++i) {
      const Eigen::Vector2d point = base + (target - base) * (static_cast<double>(i) / steps);
      is_clear = surroundings.Clearance(point) >= needed - kEaseM;
    }
    if (is_clear) best = target;
  }
  return best;
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

// Of the arcs that are free for a while, the one that leads nearest to the target.
std::optional<double> PathFollower::FreeArc(const Eigen::Vector2d& target,
                                            const Pose2& local_from_base,
                                            const Surroundings& surroundings) const {
  constexpr int kArcs = 6;  // to each side
  constexpr double kSharpestPerM = 3.0;
  std::optional<double> best;
  double nearest = (target - local_from_base.translation()).norm() - 0.25 * kDetourM;
  for (int i = -kArcs; i <= kArcs; ++i) {
    const double curvature = kSharpestPerM * i / kArcs;
    const double half_turn = 0.5 * curvature * kDetourM;
    const double chord = i == 0 ? kDetourM : 2.0 / curvature * std::sin(half_turn);
    const Eigen::Vector2d end =
        local_from_base * Eigen::Vector2d(chord * std::cos(half_turn), chord * std::sin(half_turn));
    const double distance = (target - end).norm();
    if (distance >= nearest) continue;
    const ArcView view = LookAlong(surroundings, robot_, local_from_base, curvature, 1,
                                   kDetourM + options_.margin_m, options_.margin_m);
    if (view.Passable() < kDetourM + options_.margin_m) continue;
    nearest = distance;
    best = curvature;
  }
  return best;
}

// Not so far aside that it would turn back to the route first.
std::optional<double> PathFollower::FreeHeading(double bearing_rad, const Pose2& local_from_base,
                                                const Surroundings& surroundings) const {
  constexpr double kStepRad = 0.15;
  for (double aside = kStepRad; aside < options_.turn_in_place_rad; aside += kStepRad) {
    for (const double side : {1.0, -1.0}) {
      Pose2 turned = local_from_base;
      turned.theta = WrapAngle(turned.theta + bearing_rad + side * aside);
      const ArcView view = LookAlong(surroundings, robot_, turned, 0.0, 1,
                                     kDetourM + options_.margin_m, options_.margin_m);
      if (view.free_m >= kDetourM + options_.margin_m) return turned.theta;
    }
  }
  return std::nullopt;
}

void PathFollower::Reset() {
  is_turning_ = false;
  detour_heading_rad_.reset();
  look_.reset();
  vain_look_.reset();
}

std::optional<Step> PathFollower::LookAside(Instant now, const Pose2& local_from_base,
                                            const Surroundings& surroundings) {
  const Eigen::Vector2d place = local_from_base.Inverse() * look_->beyond;
  const double bearing = std::atan2(place.y(), place.x());
  if (std::abs(bearing) < kFacedRad && !look_->faced_since) look_->faced_since = now;
  const bool is_seen = surroundings.IsSeen(look_->at) && surroundings.IsSeen(look_->beyond);
  const bool is_vain =
      !is_seen && look_->faced_since && SecondsSince(now, *look_->faced_since) > kLookS;
  if (is_seen || is_vain) {
    if (is_vain) vain_look_ = look_;
    look_.reset();
    is_turning_ = true;  // back to where the route goes
    return std::nullopt;
  }
  Step step;
  if (!look_->faced_since) step.velocity.angular_radps = TurnRate(bearing);
  return step;
}

Step PathFollower::Follow(Instant now, const std::vector<Eigen::Vector2d>& route,
                          const Pose2& local_from_base, const Surroundings& surroundings) {
  Step step;
  const Projection here = Project(route, local_from_base.translation());
  const Eigen::Vector2d target = Lookahead(route, here, local_from_base, surroundings);
  const Eigen::Vector2d ahead = local_from_base.Inverse() * target;
  step.distance_to_go_m =
      here.remaining_m + (Ahead(route, here, 0.0) - local_from_base.translation()).norm();

  if (look_) {
    if (auto look = LookAside(now, local_from_base, surroundings)) {
      look->distance_to_go_m = step.distance_to_go_m;
      return *look;
    }
  }

  const double heading_error = std::atan2(ahead.y(), ahead.x());
  if (detour_heading_rad_) {
    const double to_turn = WrapAngle(*detour_heading_rad_ - local_from_base.theta);
    if (std::abs(to_turn) > kTurnDoneRad) {
      step.velocity.angular_radps = TurnRate(to_turn);
      return step;
    }
    detour_heading_rad_.reset();
  }

  is_turning_ = std::abs(heading_error) > (is_turning_ ? kTurnDoneRad : options_.turn_in_place_rad);
  if (is_turning_) {
    step.velocity.angular_radps = TurnRate(heading_error);
    return step;
  }

  double curvature = 2.0 * ahead.y() / std::max(1e-3, ahead.squaredNorm());
  ArcView view =
      LookAlong(surroundings, robot_, local_from_base, curvature, 1, kViewM, options_.margin_m);
  if (view.free_m < kDetourM) {
    if (const auto other = FreeArc(target, local_from_base, surroundings)) {
      curvature = *other;
      view =
          LookAlong(surroundings, robot_, local_from_base, curvature, 1, kViewM, options_.margin_m);
    }
  }
  const ArcView nearby =
      LookAlong(surroundings, robot_, local_from_base, curvature, 1, kNearM, options_.margin_m);
  double speed = robot_.max_speed_mps;
  speed = std::min(speed, kTurning * robot_.max_turn_radps / std::max(1e-3, std::abs(curvature)));
  speed = std::min(speed, kNarrowMps + kMpsPerM * std::max(0.0, nearby.clearance_m));
  speed = std::min(speed, SpeedToStopWithin(step.distance_to_go_m) + kCreepMps);
  const double to_obstacle = SpeedToStopWithin(view.free_m - options_.margin_m);
  const double to_unseen = SpeedToStopWithin(view.seen_m - options_.margin_m);
  speed = std::min({speed, to_obstacle, to_unseen});
  if (surroundings.NearestMover(local_from_base.translation()) < robot_.radius_m + kBesideM) {
    speed = std::min(speed, kBesideMps);
  }

  if (speed < kCreepMps) {
    // What is ahead of the nose is not what is ahead on the route: look there first.
    if (std::abs(heading_error) > kTurnWhenStuckRad) {
      is_turning_ = true;
      step.velocity.angular_radps = TurnRate(heading_error);
      return step;
    }
    const bool is_obstacle = to_obstacle <= to_unseen;
    if (is_obstacle) {
      detour_heading_rad_ = FreeHeading(heading_error, local_from_base, surroundings);
      if (detour_heading_rad_) {
        step.velocity.angular_radps =
            TurnRate(WrapAngle(*detour_heading_rad_ - local_from_base.theta));
        return step;
      }
    }
    step.blocked_by = is_obstacle ? stop_reason::kObstacle : stop_reason::kGroundNotSeen;
    const bool is_vain = vain_look_ && view.unseen &&
                         (vain_look_->at - *view.unseen).norm() < kSamePlaceM &&
                         SecondsSince(now, *vain_look_->faced_since) < kVainS;
    if (to_unseen < kCreepMps && view.unseen && !is_vain) {
      step.blocked_by.clear();
      look_ = Look{*view.unseen, Beyond(*view.unseen, local_from_base), std::nullopt};
    }
    return step;
  }
  step.velocity = {speed, speed * curvature};
  return step;
}

}  // namespace beckon
