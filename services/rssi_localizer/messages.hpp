// What rssi_localizer knows, as messages.
#pragma once

#include <optional>

#include "beckon/location_t.hpp"
#include "beckon/planar_motion_t.hpp"
#include "beckon/probability_map_t.hpp"
#include "beckon/rssi_reading_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "bot_core/pose_t.hpp"
#include "common/frames.hpp"
#include "common/site.hpp"
#include "services/rssi_localizer/floor_grid.hpp"
#include "services/rssi_localizer/localizer.hpp"
#include "services/rssi_localizer/scan_model.hpp"

namespace beckon {

Reading ReadingFromMessage(const rssi_reading_t& message);

location_t MessageFromLocation(const TagLocation& location);

// Cells are merged, 2 x 2, 3 x 3, ... until there are at most max_cells of them: fewer than fit one
// datagram. A merged cell is walkable where one of its parts is.
inline constexpr int kMaxMapCells = 48'000;
probability_map_t MapFromLocation(const FloorGrid& grid, const TagLocation& location,
                                  int max_cells = kMaxMapCells);

// Throws std::invalid_argument for a pose that is not finite or not a rotation.
Pose2 OdometryFromMessage(const bot_core::pose_t& message);
// Throws std::invalid_argument for a motion that is OK but not finite; nothing for one that is not
// OK.
std::optional<Pose2> MotionFromMessage(const planar_motion_t& message);
RangeScan RangeScanFromMessage(const bot_core::planar_lidar_t& message);

// ROBOT_POSE: the robot is there at the time of the odometry (or of the newer frame), and moves as
// that says.
bot_core::pose_t RobotPoseMessage(const Pose2& map_from_robot, const bot_core::pose_t& odometry);
bot_core::pose_t RobotPoseMessage(const Pose2& map_from_robot, const planar_motion_t& motion);

}  // namespace beckon
