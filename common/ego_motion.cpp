#include "common/ego_motion.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr double kMaxSpeedMps = 3.0;  // faster than any robot this is for: an odometry reset
constexpr double kMaxTurnRadps = 8.0;
constexpr double kRestartS = 1.0;

bool IsPlausibleMotion(const Pose2& motion, double elapsed_s) {
  // The allowance keeps two poses of almost the same time from looking fast.
  return motion.translation().norm() <= kMaxSpeedMps * elapsed_s + 0.05 &&
         std::abs(motion.theta) <= kMaxTurnRadps * elapsed_s + 0.05;
}

}  // namespace

void EgoMotion::AddOdometry(Utime utime, const Pose2& odometry_from_robot) {
  if (!odometry_.empty()) {
    const PoseHistory::Entry& last = odometry_.newest();
    const double elapsed_s = SecondsFromUtime(utime - last.utime);
    // The base has been restarted, or somebody replays a log again: old poses belong to another
    // frame.
    if (elapsed_s < -kRestartS ||
        !IsPlausibleMotion(last.pose.Inverse() * odometry_from_robot, std::max(0.0, elapsed_s))) {
      odometry_.Clear();
    }
  }
  odometry_.Add(utime, odometry_from_robot);
}

void EgoMotion::AddGroundMotion(Utime utime_from, Utime utime, const std::optional<Pose2>& motion) {
  if (!motion || utime <= utime_from ||
      !IsPlausibleMotion(*motion, SecondsFromUtime(utime - utime_from))) {
    visual_.Clear();
    return;
  }
  if (visual_.empty() || visual_.newest().utime != utime_from) {
    visual_.Clear();
    visual_.Add(utime_from, Pose2{});
  }
  visual_.Add(utime, visual_.newest().pose * *motion);
}

void EgoMotion::Clear() {
  odometry_.Clear();
  visual_.Clear();
}

std::optional<Pose2> EgoMotion::Between(Utime from, Utime to) const {
  for (const PoseHistory* history : {&odometry_, &visual_}) {
    const auto then = history->At(from);
    const auto now = history->At(to);
    if (then && now) return then->Inverse() * *now;
  }
  return std::nullopt;
}

}  // namespace beckon
