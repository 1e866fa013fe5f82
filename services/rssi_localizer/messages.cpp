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
  for (std::size_t cell = 0; cell < location.probability.size(); ++cell) {
    const int index = grid.geometry_index()[cell];
    const int to = (index / fine.width) / merge * message.width + (index % fine.width) / merge;
    int& slot = merged_of[static_cast<std::size_t>(to)];
    if (slot == kNotWalkable) {
      slot = static_cast<int>(merged.size());
      merged.push_back(0.0F);
    }
    merged[static_cast<std::size_t>(slot)] += location.probability[cell];
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

bot_core::pose_t RobotPoseFromOdometry(const bot_core::pose_t& odometry,
                                       const Pose2& map_from_odometry) {
  if (!IsPlausible(odometry)) {
    throw std::invalid_argument("the pose is not finite or not a rotation");
  }
  const Pose2 odometry_from_robot = PoseFromMessage(odometry);
  const double forward_mps = odometry.vel[0] * std::cos(odometry_from_robot.theta) +
                             odometry.vel[1] * std::sin(odometry_from_robot.theta);
  return MessageFromPose(odometry.utime, map_from_odometry * odometry_from_robot, forward_mps,
                         odometry.rotation_rate[2]);
}

}  // namespace beckon
