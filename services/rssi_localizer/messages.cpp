#include "services/rssi_localizer/messages.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/pose_message.hpp"

namespace beckon {

Reading ReadingFromMessage(const rssi_reading_t& message) {
  return {message.utime, message.tag, message.beacon, static_cast<double>(message.rssi_dbm)};
}

location_t MessageFromLocation(const TagLocation& location) {
  location_t message{};
  message.utime = location.utime;
  message.tag = location.tag;
  switch (location.status) {
    case TagLocation::Status::kOk:
      message.status = location_t::OK;
      break;
    case TagLocation::Status::kOutside:
      message.status = location_t::OUTSIDE;
      break;
    case TagLocation::Status::kSilent:
      message.status = location_t::SILENT;
      break;
  }
  const Estimate& estimate = location.estimate;
  for (int i = 0; i < 2; ++i) {
    message.position[i] = estimate.mean[i];
    for (int j = 0; j < 2; ++j) message.covariance[2 * i + j] = estimate.covariance(i, j);
  }
  message.area_90_m2 = estimate.area_90_m2;
  message.beacons = location.beacons;
  message.readings = location.readings;
  return message;
}

probability_map_t MapFromLocation(const FloorGrid& grid, const TagLocation& location,
                                  int max_cells) {
  const GridGeometry& fine = grid.geometry();
  int merge = 1;
  const auto cells = [&](int extent) { return (extent + merge - 1) / merge; };
  while (cells(fine.width) * cells(fine.height) > max_cells) ++merge;

  probability_map_t message{};
  message.utime = location.utime;
  message.tag = location.tag;
  message.origin[0] = fine.origin.x();
  message.origin[1] = fine.origin.y();
  message.resolution_m = fine.resolution_m * merge;
  message.width = cells(fine.width);
  message.height = cells(fine.height);
  message.size = message.width * message.height;

  constexpr int kNotWalkable = -1;
  std::vector<int> merged_of(static_cast<std::size_t>(message.size), kNotWalkable);
  CellValues merged;
  const CellValues probability = location.posterior.Dense(grid.size());
  for (std::size_t cell = 0; cell < probability.size(); ++cell) {
    const int index = grid.geometry_index()[cell];
    const int to = (index / fine.width) / merge * message.width + (index % fine.width) / merge;
    int& slot = merged_of[static_cast<std::size_t>(to)];
    if (slot == kNotWalkable) {
      slot = static_cast<int>(merged.size());
      merged.push_back(0.0F);
    }
    merged[static_cast<std::size_t>(slot)] += probability[cell];
  }

  const CellValues levels = CredibleLevels(merged);
  message.credible_level.assign(static_cast<std::size_t>(message.size), 255);
  for (std::size_t i = 0; i < merged_of.size(); ++i) {
    if (merged_of[i] == kNotWalkable) continue;
    const float level = levels[static_cast<std::size_t>(merged_of[i])];
    message.credible_level[i] =
        static_cast<std::uint8_t>(std::min(254, static_cast<int>(255.0F * level)));
  }
  return message;
}

Pose2 OdometryFromMessage(const bot_core::pose_t& message) {
  if (!IsPlausible(message)) {
    throw std::invalid_argument("the pose is not finite or not a rotation");
  }
  return PoseFromMessage(message);
}

std::optional<Pose2> MotionFromMessage(const planar_motion_t& message) {
  if (message.status != planar_motion_t::OK) return std::nullopt;
  const Pose2 motion{message.translation[0], message.translation[1], message.rotation_rad};
  if (!motion.IsFinite()) throw std::invalid_argument("the motion is not finite");
  return motion;
}

RangeScan RangeScanFromMessage(const bot_core::planar_lidar_t& message) {
  return {message.rad0, message.radstep, message.ranges, message.intensities};
}

bot_core::pose_t RobotPoseMessage(const Pose2& map_from_robot, const bot_core::pose_t& odometry) {
  const double heading = PoseFromMessage(odometry).theta;
  const double forward_mps =
      odometry.vel[0] * std::cos(heading) + odometry.vel[1] * std::sin(heading);
  return MessageFromPose(odometry.utime, map_from_robot, forward_mps, odometry.rotation_rate[2]);
}

bot_core::pose_t RobotPoseMessage(const Pose2& map_from_robot, const planar_motion_t& motion) {
  const double elapsed_s = std::max(1e-3, SecondsFromUtime(motion.utime - motion.utime_from));
  return MessageFromPose(motion.utime, map_from_robot, motion.translation[0] / elapsed_s,
                         motion.rotation_rad / elapsed_s);
}

}  // namespace beckon
