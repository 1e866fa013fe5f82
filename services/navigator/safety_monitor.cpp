#include "services/navigator/safety_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

// Clocks of two hosts may differ by this much before a measurement from the future is nonsense.
constexpr double kFutureS = 0.5;
constexpr double kInvalidHoldS = 0.5;
// A picture that stays the same to the last bit while the robot moved this far is not a picture.
constexpr double kFrozenM = 0.25;
constexpr double kFrozenRad = 0.25;
constexpr int kFrozenHits = 5;
constexpr double kStandingMps = 0.01;

// Memory alone is not to be driven on: who steps in is not in it. So much of each part of the
// sector ahead has to be determined.
constexpr double kAheadRad = 0.35;
constexpr double kDetermined = 0.25;

constexpr double kOdometryTimeoutS = 0.5;
// Wheels that turn by less than the first while told to go by the second do not turn, or nobody
// counts. It is tried again after a while.
constexpr double kMovedM = 0.02;
constexpr double kMovedRad = 0.05;
constexpr double kToldM = 0.3;
constexpr double kToldRad = 0.8;
constexpr double kOdometryHoldS = 2.0;

bool IsRepetition(const Scan& a, const Scan& b) {
  if (a.ranges_m.size() != b.ranges_m.size()) return false;
  int hits = 0;
  for (std::size_t ray = 0; ray < a.ranges_m.size(); ++ray) {
    const bool both_nan = std::isnan(a.ranges_m[ray]) && std::isnan(b.ranges_m[ray]);
    if (!both_nan && a.ranges_m[ray] != b.ranges_m[ray]) return false;
    if (a.ground_seen_m[ray] != b.ground_seen_m[ray]) return false;
    if (std::isfinite(a.ranges_m[ray]) && a.ground_seen_m[ray] > 0.0F) ++hits;
  }
  // Open floor does look the same from everywhere, and so does a wall that fills the picture.
  return hits >= kFrozenHits;
}

// Moves `value` towards `target` by at most `step`.
double Approach(double value, double target, double step) {
  return value + std::clamp(target - value, -step, step);
}

}  // namespace

void ReadSafetyOptions(ConfigTable& table, SafetyOptions& options) {
  table.Optional("scan_timeout_s", options.scan_timeout_s, Range{0.1, 0.5});
  table.Optional("pose_timeout_s", options.pose_timeout_s, Range{0.1, 2.0});
  table.Optional("safety_margin_m", options.margin_m, Range{0.0, 1.0});
  table.Optional("reaction_s", options.reaction_s, Range{0.0, 2.0});
  table.Optional("pose_jump_m", options.pose_jump_m, Range{0.05, 100.0});
  table.Optional("pose_jump_rad", options.pose_jump_rad, Range{0.05, 4.0});
  table.Optional("pose_settle_s", options.pose_settle_s, Range{0.0, 10.0});
}

void SafetyMonitor::OnScan(Instant now, const Scan& scan, const Pose2& local_from_robot) {
  if (repeated_scan_ && IsRepetition(*repeated_scan_, scan)) {
    // No faster than it can go: a pose that jumps is no motion.
    const double elapsed_s = SecondsFromUtime(scan.utime - repeated_scan_->utime);
    const Pose2 moved = repeated_from_.Inverse() * local_from_robot;
    repeated_m_ += std::min(moved.translation().norm(), 1.5 * robot_.max_speed_mps * elapsed_s);
    repeated_rad_ += std::min(std::abs(moved.theta), 1.5 * robot_.max_turn_radps * elapsed_s);
    if (repeated_m_ > kFrozenM || repeated_rad_ > kFrozenRad) is_frozen_ = true;
  } else {
    is_frozen_ = false;
    repeated_m_ = repeated_rad_ = 0.0;
  }
  repeated_scan_ = scan;
  repeated_from_ = local_from_robot;
  scan_ = Arrival{now, scan.utime};
  NoteWhatIsAhead(scan);
  invalid_scan_.reset();
}

void SafetyMonitor::NoteWhatIsAhead(const Scan& scan) {
  std::array<int, kAheadParts> rays{};
  std::array<int, kAheadParts> determined{};
  for (std::size_t ray = 0; ray < scan.ranges_m.size(); ++ray) {
    const double share = 0.5 * (1.0 + WrapAngle(scan.Bearing(ray)) / kAheadRad);
    if (share < 0.0 || share >= 1.0) continue;
    const auto part = static_cast<std::size_t>(share * kAheadParts);
    ++rays[part];
    if (std::isfinite(scan.ranges_m[ray]) || scan.ground_seen_m[ray] > 0.0F) ++determined[part];
  }
  for (std::size_t part = 0; part < kAheadParts; ++part) {
    if (rays[part] > 0 && determined[part] >= kDetermined * rays[part]) sight_[part] = scan_;
  }
}

bool SafetyMonitor::SeesAhead(Instant now) const {
  return std::all_of(sight_.begin(), sight_.end(), [&](const std::optional<Arrival>& seen) {
    return seen && !IsOlder(now, *seen, options_.scan_timeout_s);
  });
}

void SafetyMonitor::ForgetPlaces() {
  repeated_scan_.reset();
  is_frozen_ = false;
  repeated_m_ = repeated_rad_ = 0.0;
}

void SafetyMonitor::OnOdometry(Instant now, Utime utime, const Pose2& odometry_from_robot) {
  const Pose2 moved = moved_from_.Inverse() * odometry_from_robot;
  if (!odometry_ || moved.translation().norm() > kMovedM || std::abs(moved.theta) > kMovedRad) {
    moved_from_ = odometry_from_robot;
    commanded_m_ = commanded_rad_ = 0.0;
  }
  odometry_ = Arrival{now, utime};
  invalid_odometry_.reset();
  if (commanded_m_ > kToldM || commanded_rad_ > kToldRad) {
    odometry_frozen_ = now;
    commanded_m_ = commanded_rad_ = 0.0;
  }
}

void SafetyMonitor::OnPose(Instant now, Utime utime, const Pose2& correction) {
  if (pose_ && (correction.translation().norm() > options_.pose_jump_m ||
                std::abs(correction.theta) > options_.pose_jump_rad)) {
    jumped_ = now;
  }
  pose_ = Arrival{now, utime};
  invalid_pose_.reset();
}

bool SafetyMonitor::IsOlder(Instant now, const Arrival& arrival, double limit_s) {
  return SecondsFromUtime(now.utime - arrival.utime) > limit_s ||
         SecondsSince(now, arrival.at) > limit_s;
}

std::string SafetyMonitor::Blocker(Instant now) const {
  if (invalid_scan_ && SecondsSince(now, *invalid_scan_) < kInvalidHoldS) {
    return stop_reason::kScanInvalid;
  }
  if (!scan_) return stop_reason::kScanMissing;
  if (SecondsFromUtime(scan_->utime - now.utime) > kFutureS) return stop_reason::kScanInvalid;
  if (IsOlder(now, *scan_, options_.scan_timeout_s)) return stop_reason::kScanStale;
  if (is_frozen_) return stop_reason::kScanFrozen;
  if (invalid_odometry_ && SecondsSince(now, *invalid_odometry_) < kInvalidHoldS) {
    return stop_reason::kOdometryInvalid;
  }
  if (odometry_ && IsOlder(now, *odometry_, kOdometryTimeoutS)) return stop_reason::kOdometryStale;
  if (odometry_frozen_ && SecondsSince(now, *odometry_frozen_) < kOdometryHoldS) {
    return stop_reason::kOdometryFrozen;
  }
  if (invalid_pose_ && SecondsSince(now, *invalid_pose_) < kInvalidHoldS) {
    return stop_reason::kPoseInvalid;
  }
  if (!pose_) return stop_reason::kPoseMissing;
  if (SecondsFromUtime(pose_->utime - now.utime) > kFutureS) return stop_reason::kPoseInvalid;
  if (IsOlder(now, *pose_, options_.pose_timeout_s)) return stop_reason::kPoseStale;
  if (jumped_ && SecondsSince(now, *jumped_) < options_.pose_settle_s)
    return stop_reason::kPoseJump;
  return stop_reason::kNone;
}

double SafetyMonitor::StoppingDistance(double speed_mps) const {
  const double speed = std::abs(speed_mps);
  return speed * options_.reaction_s + 0.5 * speed * speed / robot_.max_acceleration_mps2;
}

std::string SafetyMonitor::HazardOf(Instant now, const Velocity& velocity,
                                    const Surroundings& surroundings,
                                    const Pose2& local_from_base) const {
  // Turning on the spot, a disc sweeps nothing.
  if (std::abs(velocity.linear_mps) < kStandingMps) return stop_reason::kNone;
  if (velocity.linear_mps > 0.0 && !SeesAhead(now)) {
    return stop_reason::kGroundNotSeen;
  }
  const double length = StoppingDistance(velocity.linear_mps) + options_.margin_m;
  const int direction = velocity.linear_mps > 0.0 ? 1 : -1;
  const double curvature = velocity.angular_radps / velocity.linear_mps;
  const ArcView view = LookAlong(surroundings, robot_, local_from_base, curvature, direction,
                                 length, options_.margin_m);
  if (view.free_m < length) return stop_reason::kObstacle;
  if (view.seen_m < length) return stop_reason::kGroundNotSeen;
  return stop_reason::kNone;
}

Velocity SafetyMonitor::Limited(double elapsed_s, const Velocity& wanted) const {
  const double linear = std::clamp(wanted.linear_mps, -robot_.max_speed_mps, robot_.max_speed_mps);
  const double angular =
      std::clamp(wanted.angular_radps, -robot_.max_turn_radps, robot_.max_turn_radps);
  return {Approach(last_.linear_mps, linear, robot_.max_acceleration_mps2 * elapsed_s),
          Approach(last_.angular_radps, angular, robot_.max_turn_acceleration_radps2 * elapsed_s)};
}

SafetyMonitor::Verdict SafetyMonitor::Pass(Instant now, double elapsed_s, const Velocity& wanted,
                                           const Surroundings& surroundings,
                                           const Pose2& local_from_base, bool needs_pose) {
  Verdict verdict{wanted, Blocker(now)};
  if (!needs_pose && IsWithoutPose(verdict.reason)) verdict.reason.clear();
  if (verdict.reason.empty() &&
      !(std::isfinite(wanted.linear_mps) && std::isfinite(wanted.angular_radps))) {
    verdict.reason = stop_reason::kCommandInvalid;
  }
  if (!verdict.reason.empty()) {
    verdict.velocity = Limited(elapsed_s, {});
  } else {
    verdict.velocity = Limited(elapsed_s, wanted);
    verdict.reason = HazardOf(now, verdict.velocity, surroundings, local_from_base);
    if (!verdict.reason.empty()) {
      // Brakes along the arc that it is on: the way that was looked at is the way it takes.
      const Velocity braked = Limited(elapsed_s, {});
      const double share = std::abs(verdict.velocity.linear_mps) > kStandingMps
                               ? braked.linear_mps / verdict.velocity.linear_mps
                               : 0.0;
      verdict.velocity = Limited(elapsed_s, {0.0, share * verdict.velocity.angular_radps});
    }
  }
  last_ = verdict.velocity;
  commanded_m_ += std::abs(last_.linear_mps) * elapsed_s;
  commanded_rad_ += std::abs(last_.angular_radps) * elapsed_s;
  return verdict;
}

}  // namespace beckon
