#include "services/rssi_localizer/robot_localizer.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr double kOdometryTimeoutS = 0.5;
constexpr double kMotionTimeoutS = 1.5;
// Scans arrive with the camera's delay, well below this; motion may arrive a little later still.
constexpr double kGapS = 1.5;
constexpr double kMotionWaitS = 0.4;

// After an interruption of the motion the robot may have rolled on a bit.
constexpr double kGapM = 0.2;
constexpr double kGapRad = 0.2;

// What is wrong with the readings stays wrong until the robot is somewhere else: they count in
// proportion to the way driven, in full after the length over which shadowing changes indoors.
constexpr double kRadioStepM = 0.3;
constexpr double kRadioFullM = 1.5;
constexpr std::size_t kMostReadings = 2000;

// Of a start that is told: where the odometry frame lies was measured by hand, or the odometry has
// drifted since.
constexpr double kStartSdM = 0.1;
constexpr double kStartSdRad = 0.05;

}  // namespace

RobotLocalizer::RobotLocalizer(const SiteModel& model, const RobotLocalizerOptions& options)
    : model_(model),
      options_(options),
      filter_(model.site.plan, model.grid, options.filter),
      waits_for_told_start_(options.map_from_odometry.has_value()) {}

std::optional<Pose2> RobotLocalizer::AddOdometry(Instant now, Utime utime,
                                                 const Pose2& odometry_from_robot) {
  odometry_at_ = motion_at_ = now;
  motion_.AddOdometry(utime, odometry_from_robot);
  StartWhereTold(utime, odometry_from_robot);
  Follow(utime);
  return At(utime);
}

std::optional<Pose2> RobotLocalizer::AddGroundMotion(Instant now, Utime utime_from, Utime utime,
                                                     const std::optional<Pose2>& motion) {
  motion_.AddGroundMotion(utime_from, utime, motion);
  if (!ground_motion_since_) ground_motion_since_ = now;
  // At the start the odometry gets its time to appear: a start that is told is told for it.
  if (SecondsSince(now, odometry_at_.value_or(*ground_motion_since_)) < kOdometryTimeoutS) {
    return std::nullopt;
  }
  if (!motion) return std::nullopt;
  motion_at_ = now;
  StartWhereTold(utime, *motion);
  Follow(utime);
  return At(utime);
}

void RobotLocalizer::StartWhereTold(Utime utime, const Pose2& odometry_from_robot) {
  if (!waits_for_told_start_) return;
  waits_for_told_start_ = false;
  filter_.StartAt(*options_.map_from_odometry * odometry_from_robot, kStartSdM, kStartSdRad);
  utime_ = utime;
}

void RobotLocalizer::AddScan(Instant now, Utime utime, const RangeScan& scan) {
  scan_at_ = now;
  if (waits_for_told_start_) return;
  // A frame out of order tells nothing that newer ones do not. Time that has gone back for good
  // does.
  const Utime newest = scan_ ? scan_->utime : utime_.value_or(utime - 1);
  if (utime <= newest && newest - utime < UtimeFromSeconds(kGapS)) return;
  if (!UseScan()) {
    if (std::abs(SecondsFromUtime(utime - scan_->utime)) < kMotionWaitS) return;
    JumpTo(utime);
  }
  scan_ = PendingScan{utime, scan};
  UseScan();
}

bool RobotLocalizer::UseScan() {
  if (!scan_) return true;
  if (!MoveTo(scan_->utime)) return false;
  const RangeScan scan = std::move(scan_->scan);
  scan_.reset();
  UseRadio();
  filter_.AddScan(scan);
  return true;
}

// Keeps up with the motion, which is remembered for a few seconds only.
void RobotLocalizer::Follow(Utime newest) {
  UseScan();
  if (!utime_ || std::abs(SecondsFromUtime(newest - *utime_)) < kGapS) return;
  const Utime followed = newest - UtimeFromSeconds(0.5 * kGapS);
  if (MoveTo(followed)) {
    UseRadio();
  } else {
    JumpTo(newest);
  }
}

bool RobotLocalizer::MoveTo(Utime utime) {
  if (utime_) {
    const auto motion = motion_.Between(*utime_, utime);
    if (!motion) return false;
    filter_.Move(*motion);
    radio_m_ += motion->translation().norm();
  }
  utime_ = utime;
  return true;
}

// Nobody knows how it has moved since.
void RobotLocalizer::JumpTo(Utime utime) {
  filter_.Disturb(kGapM, kGapRad);
  utime_ = utime;
  scan_.reset();
}

std::optional<Pose2> RobotLocalizer::At(Utime utime) const {
  if (!filter_.is_located() || !utime_) return std::nullopt;
  const auto motion = motion_.Between(*utime_, utime);
  if (!motion) return std::nullopt;
  return filter_.belief().map_from_robot * *motion;
}

void RobotLocalizer::AddReading(const Reading& reading) {
  if (reading.tag != options_.robot_tag || readings_.size() >= kMostReadings) return;
  const int beacon = model_.site.BeaconIndex(reading.beacon);
  if (beacon < 0) return;
  readings_.push_back({reading.utime, beacon, reading.rssi_dbm});
  const Utime oldest = reading.utime - UtimeFromSeconds(model_.site.window_s);
  std::erase_if(readings_, [&](const BeaconReading& old) { return old.utime <= oldest; });
}

void RobotLocalizer::AddLocation(const TagLocation& location) {
  if (location.tag == options_.robot_tag) {
    filter_.SetRadioPosterior(location.posterior.Dense(model_.grid.size()));
  }
}

void RobotLocalizer::UseRadio() {
  if (radio_m_ < kRadioStepM || readings_.empty()) return;
  // The first time every beacon is waited for.
  const double heard_s = SecondsFromUtime(readings_.back().utime - readings_.front().utime);
  if (std::isinf(radio_m_) && heard_s < 0.5 * model_.site.window_s) return;
  CellValues log_likelihood =
      LogLikelihood(model_.model, MeanPerBeacon(readings_, model_.choice.averaging),
                    model_.choice.trust, model_.grid.size());
  const auto share = static_cast<float>(std::min(1.0, radio_m_ / kRadioFullM));
  for (float& value : log_likelihood) value *= share;
  filter_.AddRadio(log_likelihood);
  readings_.clear();
  radio_m_ = 0.0;
}

std::string RobotLocalizer::Doubt(Instant now) const {
  const auto is_silent = [&](const std::optional<Instant>& at) {
    return !at || SecondsSince(now, *at) > kMotionTimeoutS;
  };
  if (!motion_at_ && !scan_at_) return "";  // there is no robot
  if (is_silent(motion_at_)) return "no ODOMETRY or GROUND_MOTION";
  if (!filter_.is_located() && is_silent(scan_at_)) return "no SCAN to find the robot by";
  return filter_.Doubt();
}

}  // namespace beckon
