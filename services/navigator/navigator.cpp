#include "services/navigator/navigator.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>

#include "services/navigator/stop_reasons.hpp"

namespace beckon {
namespace {

constexpr double kReplanS = 1.0;
constexpr double kReplanSoonS = 0.3;
constexpr double kGoalMovedM = 0.25;
constexpr double kRouteEndM = 0.12;
constexpr double kStandingMps = 0.02;
constexpr double kMaxTickS = 0.2;
constexpr double kFindItselfS = 180.0;
constexpr double kPlaceableS = 0.5;  // a pose farther from now than this needs a history

// Longer than a button's message takes through any radio network; clocks of two hosts that are kept
// by NTP differ by far less than the second.
constexpr double kOldestCallS = 10.0;
constexpr double kFutureCallS = 1.0;

// Patience with whatever is in the way: people walk on.
constexpr double kWaitForObstacleS = 4.0;
constexpr double kTurnToAndFroS = 15.0;  // looking left and right takes ten
constexpr double kWaitAtGoalS = 2.0;
constexpr double kNearGoalM = 1.1;
constexpr double kWaitForRouteS = 1.5;
constexpr double kProgressM = 0.15;
constexpr double kStillM = 0.1;
constexpr double kStillRad = 0.2;

void CheckScan(const Scan& scan) {
  constexpr std::size_t kMaxRays = 20'000;
  constexpr double kMaxRangeM = 1e3;
  const std::size_t rays = scan.ranges_m.size();
  if (rays < 2 || rays > kMaxRays) throw std::invalid_argument("a scan of that many rays");
  if (scan.ground_seen_m.size() != rays) {
    throw std::invalid_argument("a scan needs as many intensities as ranges");
  }
  const double step = std::abs(scan.bearing_step_rad);
  if (!(std::abs(scan.first_bearing_rad) <= 2.0 * std::numbers::pi && step > 1e-5 &&
        step * static_cast<double>(rays - 1) <= 2.0 * std::numbers::pi)) {
    throw std::invalid_argument("a scan with bearings that cannot be");
  }
  for (const float range : scan.ranges_m) {
    if (range < 0.0F || (std::isfinite(range) && range > kMaxRangeM)) {
      throw std::invalid_argument("a scan with a range that cannot be");
    }
  }
  for (const float seen : scan.ground_seen_m) {
    if (!(seen >= 0.0F && seen <= kMaxRangeM)) {
      throw std::invalid_argument("a scan with ground seen as far as cannot be");
    }
  }
}

void CheckGrid(const SeenGrid& grid) {
  if (grid.grid.width < 1 || grid.grid.height < 1 ||
      grid.occupancy.size() != static_cast<std::size_t>(grid.grid.size()) ||
      !(grid.grid.resolution_m > 1e-3 && grid.grid.resolution_m < 10.0)) {
    throw std::invalid_argument("a grid whose size does not fit its cells");
  }
  if (!grid.grid_from_robot.IsFinite()) {
    throw std::invalid_argument("a grid without a finite pose");
  }
}

void CheckCall(const Call& call) {
  if (call.kind == Call::Kind::kTag && call.tag.empty()) {
    throw std::invalid_argument("a call by a tag without a name");
  }
  if (call.kind == Call::Kind::kPoint && !call.point.allFinite()) {
    throw std::invalid_argument("a call to a point that is not finite");
  }
}

// Why a call made at this time is not to be obeyed; empty where it is.
std::string WhyUntimely(Instant now, const Call& call) {
  const double age_s = SecondsFromUtime(now.utime - call.utime);
  if (age_s <= kOldestCallS && age_s >= -kFutureCallS) return "";
  char text[120];
  std::snprintf(text, sizeof(text),
                "a call made %.1f s %s: played back, or the caller's clock is wrong",
                std::abs(age_s), age_s > 0.0 ? "ago" : "from now");
  return text;
}

std::string Metres(double metres) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f m", metres);
  return text;
}

}  // namespace

Navigator::Navigator(const NavigatorOptions& options, const FloorPlan& plan)
    : options_(options),
      planner_(plan, options.robot, options.route),
      follower_(options.robot, options.follower),
      monitor_(options.robot, options.safety),
      surroundings_(options.robot),
      recovery_(options_.robot, follower_, monitor_, options.follower.margin_m),
      frame_(options.robot),
      destination_(options.arrival),
      wanderer_(options.robot, options.follower.margin_m) {}

void Navigator::OnCall(Instant now, const Call& call) {
  CheckCall(call);
  const std::string why = call.kind == Call::Kind::kCancel ? "" : WhyUntimely(now, call);
  if (!why.empty()) {
    if (status_.state == NavigatorState::kIdle) status_.detail = "refused " + why;
    throw std::invalid_argument(why);
  }
  Answer(now, call);
}

void Navigator::Resume(Instant now, const Call& call) {
  CheckCall(call);
  Answer(now, call);
}

void Navigator::Answer(Instant now, const Call& call) {
  // Who calls again while the robot stands where it took the caller to be is somewhere else.
  const bool is_repeated = status_.state == NavigatorState::kArrived &&
                           call.kind == Call::Kind::kTag && status_.tag == call.tag;
  if (is_repeated && destination_.TryElsewhere(now, map_base_, planner_)) {
    StartDriving(now);
    return;
  }
  StartDriving(now);
  status_ = {};
  destination_.Clear();
  if (call.kind == Call::Kind::kCancel) return;
  destination_.Set(call);
  status_.state = NavigatorState::kDriving;
  status_.tag = call.kind == Call::Kind::kTag ? call.tag : "";
  if (call.kind == Call::Kind::kPoint && !planner_.IsInArea(call.point)) {
    Finish(NavigatorState::kGaveUp, "the point is outside the floor plan");
  }
}

void Navigator::StartDriving(Instant now) {
  DropRoute();
  FollowAgain(now);
  recovery_.ForgetAttempts();
  no_progress_s_ = 0.0;
  nearest_to_go_m_ = std::numeric_limits<double>::infinity();
  posed_or_called_ = now;
  finding_since_.reset();
  status_.state = NavigatorState::kDriving;
}

void Navigator::OnPossibleArea(Instant now, const PossibleArea& area) {
  if (area.grid.width < 1 || area.grid.height < 1 || !(area.grid.resolution_m > 1e-3) ||
      !area.grid.origin.allFinite() ||
      area.credible_level.size() != static_cast<std::size_t>(area.grid.size())) {
    throw std::invalid_argument("a possible area whose size does not fit its cells");
  }
  destination_.OnPossibleArea(now, area);
}

void Navigator::OnLocation(Instant now, const LocatedTag& location) {
  if (location.is_located && !(location.position.allFinite() && location.covariance.allFinite() &&
                               location.area_90_m2 >= 0.0 && std::isfinite(location.area_90_m2))) {
    throw std::invalid_argument("a location that is not finite");
  }
  destination_.OnLocation(now, location);
}

void Navigator::OnPose(Instant now, Utime utime, const Pose2& map_from_robot) {
  if (!map_from_robot.IsFinite()) {
    monitor_.OnInvalidPose(now);
    throw std::invalid_argument("a pose that is not finite");
  }
  const auto then = frame_.At(utime);
  if (!then && std::abs(SecondsFromUtime(now.utime - utime)) > kPlaceableS) {
    monitor_.OnPose(now, utime, {});  // which says that it is too old, or from the future
    return;
  }
  const Pose2 local_from_robot = then.value_or(frame_.Now(now));
  const Pose2 map_from_local = map_from_robot * local_from_robot.Inverse();
  const Pose2 correction =
      map_from_local_ ? (*map_from_local_ * local_from_robot).Inverse() * map_from_robot : Pose2{};
  monitor_.OnPose(now, utime, correction);
  posed_or_called_ = now;
  map_from_local_ = map_from_local;
}

void Navigator::OnOdometry(Instant now, Utime utime, const Pose2& odometry_from_robot) {
  if (!odometry_from_robot.IsFinite()) {
    monitor_.OnInvalidOdometry(now);
    throw std::invalid_argument("odometry that is not finite");
  }
  monitor_.OnOdometry(now, utime, odometry_from_robot);
  if (frame_.AddOdometry(now, utime, odometry_from_robot)) return;
  monitor_.OnInvalidOdometry(now);
  ForgetFrame();
}

void Navigator::ForgetFrame() {
  surroundings_.Clear();
  monitor_.ForgetPlaces();
  map_from_local_.reset();
  DropRoute();
}

void Navigator::OnScan(Instant now, Scan scan) {
  try {
    CheckScan(scan);
    const Utime newest = scan_utime_;
    scan_utime_ = scan.utime;
    if (scan.utime < newest) throw std::invalid_argument("the time of scans runs backwards");
    if (scan.utime == newest) return;
  } catch (const std::invalid_argument&) {
    monitor_.OnInvalidScan(now);
    throw;
  }
  const Pose2 local_from_robot = frame_.At(scan.utime).value_or(frame_.Now(now));
  monitor_.OnScan(now, scan, local_from_robot);
  surroundings_.SetScan(std::move(scan), local_from_robot);
}

void Navigator::OnGrid(Instant now, SeenGrid grid) {
  try {
    CheckGrid(grid);
  } catch (const std::invalid_argument&) {
    surroundings_.DropGrid();
    throw;
  }
  const auto local_from_robot = frame_.At(grid.utime);
  if (!local_from_robot) return;  // too old to be placed
  surroundings_.SetGrid(now, std::move(grid), *local_from_robot);
  if (map_from_local_) {
    planner_.Remember(*surroundings_.grid(), *map_from_local_ * surroundings_.local_from_grid(),
                      now);
  }
}

Velocity Navigator::Tick(Instant now) {
  const double elapsed_s = ticked_ ? std::clamp(SecondsSince(now, *ticked_), 0.0, kMaxTickS) : 0.0;
  ticked_ = now;
  if (!frame_.AddCommand(now, monitor_.last())) ForgetFrame();
  const Pose2 local_from_base = frame_.Now(now) * options_.robot.RobotFromBase();
  surroundings_.Update(now, local_from_base);
  status_.nearest_obstacle_m = surroundings_.NearestInScan(local_from_base);

  if (map_from_local_) map_base_ = *map_from_local_ * local_from_base.translation();
  FollowIfGone(now);

  Velocity wanted;
  bool finds_itself = false;
  if (ActiveCall()) {
    status_.state = NavigatorState::kDriving;
    status_.stop_reason.clear();
    status_.detail.clear();
    const std::string blocker = monitor_.Blocker(now);
    finds_itself = SafetyMonitor::IsWithoutPose(blocker) && options_.find_itself_after_s > 0.0 &&
                   SecondsSince(now, posed_or_called_) > options_.find_itself_after_s;
    if (finds_itself) wanted = FindItself(now, local_from_base);
    if (blocker.empty()) {
      StopFindingItself(now);
      no_progress_s_ += elapsed_s;
      wanted = Drive(now, local_from_base);
    }
  }
  const SafetyMonitor::Verdict verdict =
      monitor_.Pass(now, elapsed_s, wanted, surroundings_, local_from_base, !finds_itself);
  if (ActiveCall() && !verdict.reason.empty()) {
    ReportStop(verdict.reason, "stopped by the safety monitor");
  }
  // How long it has been standing before something that may need more than patience.
  const std::string& reason = status_.stop_reason;
  const bool is_blocked = reason == stop_reason::kObstacle ||
                          reason == stop_reason::kGroundNotSeen || reason == stop_reason::kNoRoute;
  if (!is_blocked) blocked_since_.reset();
  if (is_blocked && !blocked_since_) blocked_since_ = now;
  return verdict.velocity;
}

void Navigator::FollowIfGone(Instant now) {
  if (status_.state != NavigatorState::kArrived || !monitor_.Blocker(now).empty() ||
      !destination_.HasGone(now, map_base_)) {
    return;
  }
  StartDriving(now);
}

std::optional<Call> Navigator::ActiveCall() const {
  if (status_.state != NavigatorState::kDriving && status_.state != NavigatorState::kStopped) {
    return std::nullopt;
  }
  return destination_.call();
}

Velocity Navigator::Drive(Instant now, const Pose2& local_from_base) {
  const auto goal = destination_.Goal();
  const std::string doubt = destination_.Doubt(now);
  if (!goal || !doubt.empty()) {
    ReportStop(doubt, "waiting for the tag to be located");
    if (no_progress_s_ > options_.give_up_after_s) {
      GiveUp(now, "the tag is not heard");
    }
    return {};
  }
  status_.has_goal = true;
  status_.goal = goal->point;
  if (!map_from_local_) {
    ReportStop(stop_reason::kPoseMissing, "waiting for the robot's place on the map");
    return {};
  }
  const Pose2 map_from_base = *map_from_local_ * local_from_base;
  if (!planner_.IsInArea(map_base_)) {
    ReportStop(stop_reason::kPoseInvalid, "the robot's place is outside the floor plan");
    return {};
  }
  if (IsRouteDue(now, *goal)) UpdateRoute(now, map_from_base, *goal);

  const double blocked_s = blocked_since_ ? SecondsSince(now, *blocked_since_) : 0.0;
  Step step;
  if (!route_.empty()) step = follower_.Follow(now, route_, local_from_base, surroundings_);
  // While there is no route, the last one says how far it is.
  if (!route_.empty()) status_.distance_to_go_m = step.distance_to_go_m;
  status_.route.clear();
  for (const Eigen::Vector2d& point : route_) status_.route.push_back(*map_from_local_ * point);

  // Who stands in the way close to the goal may well be the caller.
  const bool is_near = (map_base_ - goal->point).norm() < kNearGoalM;
  const bool is_kept_off =
      planner_.HasLineOfSight(goal->point, map_base_) &&
      ((is_near && destination_.call()->kind == Call::Kind::kTag &&
        surroundings_.IsObstructed(local_from_base.translation(),
                                   map_from_local_->Inverse() * goal->point)) ||
       (blocked_s > kWaitAtGoalS && (is_near || recovery_.attempts() > 1)));
  const bool is_at_end = is_kept_off || (!route_.empty() && step.distance_to_go_m < kRouteEndM);
  if (destination_.HasArrived(map_base_, is_at_end, planner_)) {
    if (std::abs(monitor_.last().linear_mps) < kStandingMps) {
      const double distance = (map_base_ - goal->point).norm();
      destination_.NoteArrival(map_base_);
      Finish(NavigatorState::kArrived, Metres(distance) + " from where the call came from");
    }
    return {};
  }
  if (route_.empty() && !plan_has_way_ && blocked_s > kWaitForRouteS) {
    GiveUp(now, "the floor plan shows no way there");
    return {};
  }

  WatchProgress(now, status_.distance_to_go_m, local_from_base);
  if (!ActiveCall()) return {};
  if (recovery_.is_active()) return Recover(now, local_from_base);
  if (route_.empty()) {
    ReportStop(stop_reason::kNoRoute, "no way round what has been seen");
    return {};
  }
  if (!step.blocked_by.empty()) ReportStop(step.blocked_by, "waiting for the way to be free");
  return step.velocity;
}

bool Navigator::IsRouteDue(Instant now, const RouteGoal& goal) const {
  if (!planned_ || !route_goal_) return true;
  const double age_s = SecondsSince(now, *planned_);
  if (age_s > kReplanS) return true;
  const bool is_wanted =
      route_.empty() || blocked_since_ || (goal.point - route_goal_->point).norm() > kGoalMovedM;
  return is_wanted && age_s > kReplanSoonS;
}

void Navigator::UpdateRoute(Instant now, const Pose2& map_from_base, const RouteGoal& goal) {
  std::vector<Eigen::Vector2d> hidden = surroundings_.Hidden();
  for (Eigen::Vector2d& point : hidden) point = *map_from_local_ * point;
  const Route route = planner_.Plan(map_from_base.translation(), goal, now, hidden);
  planned_ = now;
  route_goal_ = goal;
  plan_has_way_ = route.plan_has_way;
  route_.clear();
  if (!route.is_found) return;
  const Pose2 local_from_map = map_from_local_->Inverse();
  for (const Eigen::Vector2d& point : route.points) route_.push_back(local_from_map * point);
}

void Navigator::WatchProgress(Instant now, double distance_to_go_m, const Pose2& local_from_base) {
  if (!route_.empty() && distance_to_go_m < nearest_to_go_m_ - kProgressM) {
    nearest_to_go_m_ = distance_to_go_m;
    no_progress_s_ = 0.0;
  }
  // A caller who walks away is followed: the way there is a new one.
  if ((status_.goal - progress_goal_).norm() > 1.0) {
    progress_goal_ = status_.goal;
    nearest_to_go_m_ = std::numeric_limits<double>::infinity();
  }
  const double allowed_s =
      options_.give_up_after_s + 3.0 * distance_to_go_m / options_.robot.max_speed_mps;
  if (no_progress_s_ > allowed_s) {
    GiveUp(now, "no progress, " + Metres(distance_to_go_m) + " to go");
    return;
  }

  if (recovery_.is_active()) return;
  const Pose2 moved = moved_from_.Inverse() * local_from_base;
  if (!moved_at_ || moved.translation().norm() > kStillM || std::abs(moved.theta) > kStillRad) {
    moved_at_ = now;
    moved_from_ = local_from_base;
  }
  if (!drove_at_ || (local_from_base.translation() - drove_from_).norm() > kStillM) {
    drove_at_ = now;
    drove_from_ = local_from_base.translation();
  }
  recovery_.NoteProgress(local_from_base);
  const bool is_without_route =
      route_.empty() && blocked_since_ && SecondsSince(now, *blocked_since_) > kWaitForRouteS;
  if (is_without_route || SecondsSince(now, *moved_at_) > kWaitForObstacleS ||
      SecondsSince(now, *drove_at_) > kTurnToAndFroS) {
    StartRecovery(now, local_from_base);
  }
}

void Navigator::StartRecovery(Instant now, const Pose2& local_from_base) {
  if (!recovery_.Start(local_from_base, surroundings_)) {
    GiveUp(now, route_.empty() ? "no way round what has been seen" : "the way is blocked");
    return;
  }
  moved_at_ = drove_at_ = now;
  // What stood in rooms out of view may have gone; it is met again if it has not.
  if (recovery_.is_looking_around()) planner_.ForgetSeen();
}

Velocity Navigator::Recover(Instant now, const Pose2& local_from_base) {
  const auto velocity = recovery_.Continue(local_from_base, surroundings_);
  if (!velocity) FollowAgain(now);
  status_.detail = recovery_.Description();
  return velocity.value_or(Velocity{});
}

void Navigator::FollowAgain(Instant now) {
  recovery_.Stop();
  follower_.Reset();
  blocked_since_.reset();
  moved_at_ = drove_at_ = now;
}

// Looks round, and then goes where the floor is free and it has not been, looking round again where
// that leads nowhere.
Velocity Navigator::FindItself(Instant now, const Pose2& local_from_base) {
  if (!finding_since_) {
    finding_since_ = now;
    // What was seen lies in wrong places of the map if the robot did not know where it was.
    map_from_local_.reset();
    planner_.ForgetSeen();
    DropRoute();
    status_.route.clear();
    wanderer_.Clear();
    recovery_.StartLookingAround(local_from_base);
  }
  if (SecondsSince(now, *finding_since_) > kFindItselfS) {
    Finish(NavigatorState::kGaveUp, "the robot does not find itself on the map");
    return {};
  }
  if (recovery_.is_active()) return Recover(now, local_from_base);
  status_.detail = "looking for itself on the map";
  if (!route_.empty()) {
    const Step step = follower_.Follow(now, route_, local_from_base, surroundings_);
    if (step.blocked_by.empty() && step.distance_to_go_m > kRouteEndM) return step.velocity;
  }
  DropRoute();
  if (const auto place = wanderer_.NextPlace(local_from_base, surroundings_)) {
    route_ = {local_from_base.translation(), *place};
  } else {
    recovery_.StartLookingAround(local_from_base);
  }
  return {};
}

void Navigator::StopFindingItself(Instant now) {
  if (!finding_since_) return;
  finding_since_.reset();
  DropRoute();
  FollowAgain(now);
}

void Navigator::DropRoute() {
  route_.clear();
  route_goal_.reset();
  planned_.reset();
  plan_has_way_ = true;
  follower_.Reset();
}

void Navigator::GiveUp(Instant now, const std::string& why) {
  const bool is_tag = destination_.call()->kind == Call::Kind::kTag;
  if (is_tag && destination_.TryElsewhere(now, map_base_, planner_)) {
    StartDriving(now);
    return;
  }
  Finish(NavigatorState::kGaveUp, why);
}

void Navigator::Finish(NavigatorState state, const std::string& detail) {
  status_.state = state;
  status_.stop_reason.clear();
  status_.detail = detail;
  status_.route.clear();
  DropRoute();
  recovery_.Stop();
}

void Navigator::ReportStop(const std::string& reason, const std::string& detail) {
  status_.state = NavigatorState::kStopped;
  status_.stop_reason = reason;
  status_.detail = detail;
}

}  // namespace beckon
