#include "common/odometry_frame.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr double kSetBackS = 1.0;
// Keeps two poses of almost the same time from looking fast, and what it hides is no more than what
// odometry errs by in a few metres.
constexpr double kSlackM = 0.05;
constexpr double kSlackRad = 0.05;
// A base whose odometry is silent stops by itself or is stopped: after so long nothing more is
// explained by its speed.
constexpr double kLongestDriveS = 1.0;

// x as well is zero at the axle, but not where the robot's origin lies ahead of it.
bool IsAtBeginning(const Pose2& pose) { return pose.y == 0.0 && pose.theta == 0.0; }

}  // namespace

bool IsTooFast(const Pose2& motion, double elapsed_s, const MotionLimits& limits) {
  return motion.translation().norm() > limits.speed_mps * elapsed_s + kSlackM ||
         std::abs(motion.theta) > limits.turn_radps * elapsed_s + kSlackRad;
}

bool IsAnotherFrame(const PoseHistory::Entry& last, Utime utime, const Pose2& pose,
                    const MotionLimits& limits) {
  const double elapsed_s = SecondsFromUtime(utime - last.utime);
  if (elapsed_s < -kSetBackS) return true;
  const Pose2 motion = last.pose.Inverse() * pose;
  const bool begins_anew = IsAtBeginning(pose) && !IsAtBeginning(last.pose);
  return IsTooFast(motion, std::min(std::abs(elapsed_s), kLongestDriveS), limits) ||
         (begins_anew && IsTooFast(motion, 0.0, limits));
}

}  // namespace beckon
