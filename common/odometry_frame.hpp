// Whether odometry goes on, or its base has been restarted.
#pragma once

#include "common/clock.hpp"
#include "common/pose_history.hpp"

namespace beckon {

// The fastest that a base goes.
struct MotionLimits {
  double speed_mps;
  double turn_radps;
};

// Whether no base moves that far in that time; a few centimetres and degrees always pass.
bool IsTooFast(const Pose2& motion, double elapsed_s, const MotionLimits& limits);

// Whether a pose cannot follow from the last one, and so is told in another frame: time ran back by
// more than a second, no base moves that fast, or y and heading are zero to the last bit again.
// That is where a restarted base begins, and where no wheels come back to. What goes unnoticed is a
// base restarted within 5 cm and 3 degrees of where it began to count, where its frame is as good
// as the old one, or one that has never turned.
bool IsAnotherFrame(const PoseHistory::Entry& last, Utime utime, const Pose2& pose,
                    const MotionLimits& limits);

}  // namespace beckon
