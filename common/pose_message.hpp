// bot_core.pose_t to and from planar poses.
#pragma once

#include "bot_core/pose_t.hpp"
#include "common/clock.hpp"
#include "common/frames.hpp"

namespace beckon {

// Heading is the rotation about z of the orientation.
Pose2 PoseFromMessage(const bot_core::pose_t& message);

// `forward_mps` along the robot's x axis; `turn_radps` counter-clockwise.
bot_core::pose_t MessageFromPose(Utime utime, const Pose2& pose, double forward_mps,
                                 double turn_radps);

// Whether all numbers are finite and the orientation is a unit quaternion (within 1 %).
bool IsPlausible(const bot_core::pose_t& message);

}  // namespace beckon
