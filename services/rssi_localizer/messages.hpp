// What rssi_localizer knows, as messages.
#pragma once

#include "beckon/location_t.hpp"
#include "beckon/probability_map_t.hpp"
#include "beckon/rssi_reading_t.hpp"
#include "bot_core/pose_t.hpp"
#include "common/frames.hpp"
#include "common/site.hpp"
#include "services/rssi_localizer/floor_grid.hpp"
#include "services/rssi_localizer/localizer.hpp"

namespace beckon {

Reading ReadingFromMessage(const rssi_reading_t& message);

location_t MessageFromLocation(const TagLocation& location);

// Cells are merged, 2 x 2, 3 x 3, ... until there are at most max_cells of them: fewer than fit one
// datagram. A merged cell is walkable where one of its parts is.
inline constexpr int kMaxMapCells = 48'000;
probability_map_t MapFromLocation(const FloorGrid& grid, const TagLocation& location,
                                  int max_cells = kMaxMapCells);

// ROBOT_POSE from ODOMETRY: the robot as odometry sees it, moved into the map frame. Throws
// std::invalid_argument for a pose that is not plausible.
bot_core::pose_t RobotPoseFromOdometry(const bot_core::pose_t& odometry,
                                       const Pose2& map_from_odometry);

}  // namespace beckon
