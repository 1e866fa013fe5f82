#include "common/ego_motion.hpp"

#include "common/odometry_frame.hpp"

namespace beckon {
namespace {

// Faster than any robot this is for.
constexpr MotionLimits kLimits{.speed_mps = 3.0, .turn_radps = 8.0};

}  // namespace

void EgoMotion::AddOdometry(Utime utime, const Pose2& odometry_from_robot) {
  // The base has been restarted, or somebody replays a log again.
  if (!odometry_.empty() &&
      IsAnotherFrame(odometry_.newest(), utime, odometry_from_robot, kLimits)) {
    odometry_.Clear();
  }
  odometry_.Add(utime, odometry_from_robot);
}

void EgoMotion::AddGroundMotion(Utime utime_from, Utime utime, const std::optional<Pose2>& motion) {
  if (!motion || utime <= utime_from ||
      IsTooFast(*motion, SecondsFromUtime(utime - utime_from), kLimits)) {
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
