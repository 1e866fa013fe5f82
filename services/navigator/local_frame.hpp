// Where the robot is in a frame that stands still on the floor and does not jump.
#pragma once

#include <optional>

#include "common/clock.hpp"
#include "common/pose_history.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

// The odometry frame. While there is no odometry, the robot is taken to do what it was told.
class LocalFrame {
 public:
  explicit LocalFrame(const RobotOptions& robot) : robot_(robot) {}

  // False when the pose cannot follow from the ones before: the frame is then a new one, and what
  // was placed in the old one is lost.
  bool AddOdometry(Instant now, Utime utime, const Pose2& local_from_robot);
  // The robot moves with this velocity from now on. Returns false as AddOdometry does: the wall
  // clock was set back.
  bool AddCommand(Instant now, const Velocity& velocity);

  // Pose at a moment of the last seconds.
  std::optional<Pose2> At(Utime utime) const { return history_.At(utime, kExtrapolationS); }
  // The newest pose, carried on to now.
  Pose2 Now(Instant now) const;

 private:
  static constexpr double kExtrapolationS = 0.3;

  RobotOptions robot_;
  PoseHistory history_;
  std::optional<Instant> odometry_at_;
  std::optional<Instant> commanded_at_;
  Velocity command_;
};

}  // namespace beckon
