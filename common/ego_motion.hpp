// How the robot moved between two moments, from whatever there is that tells.
#pragma once

#include <optional>

#include "common/clock.hpp"
#include "common/frames.hpp"
#include "common/pose_history.hpp"

namespace beckon {

// The robot's motion between two moments: from odometry where it covers them, else from
// GROUND_MOTION.
class EgoMotion {
 public:
  void AddOdometry(Utime utime, const Pose2& odometry_from_robot);
  // `motion`: pose at `utime` in the robot frame at `utime_from`; nothing when it could not
  // be found.
  void AddGroundMotion(Utime utime_from, Utime utime, const std::optional<Pose2>& motion);
  void Clear();

  // Pose of the robot at `to` in the robot frame at `from`; nothing while it is not known.
  std::optional<Pose2> Between(Utime from, Utime to) const;

 private:
  PoseHistory odometry_;
  PoseHistory visual_;
};

}  // namespace beckon
