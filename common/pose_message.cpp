#include "common/pose_message.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {

Pose2 PoseFromMessage(const bot_core::pose_t& message) {
  const auto* q = message.orientation;  // w, x, y, z
  const double yaw =
      std::atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]));
  return {message.pos[0], message.pos[1], yaw};
}

bot_core::pose_t MessageFromPose(Utime utime, const Pose2& pose, double forward_mps,
                                 double turn_radps) {
  bot_core::pose_t message{};
  message.utime = utime;
  message.pos[0] = pose.x;
  message.pos[1] = pose.y;
  message.vel[0] = forward_mps * std::cos(pose.theta);
  message.vel[1] = forward_mps * std::sin(pose.theta);
  message.orientation[0] = std::cos(pose.theta / 2.0);
  message.orientation[3] = std::sin(pose.theta / 2.0);
  message.rotation_rate[2] = turn_radps;
  return message;
}

bool IsPlausible(const bot_core::pose_t& message) {
  const auto finite = [](const auto& numbers) {
    return std::all_of(std::begin(numbers), std::end(numbers),
                       [](double n) { return std::isfinite(n); });
  };
  if (!finite(message.pos) || !finite(message.vel) || !finite(message.orientation) ||
      !finite(message.rotation_rate) || !finite(message.accel)) {
    return false;
  }
  double square = 0.0;
  for (const double component : message.orientation) square += component * component;
  return std::abs(square - 1.0) < 0.02;
}

}  // namespace beckon
