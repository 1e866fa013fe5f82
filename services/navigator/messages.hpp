// Messages of navigator, to and from what its algorithms work on. Those that hold nonsense throw
// std::invalid_argument.
#pragma once

#include <functional>

#include "beckon/call_t.hpp"
#include "beckon/location_t.hpp"
#include "beckon/navigator_status_t.hpp"
#include "beckon/occupancy_grid_t.hpp"
#include "beckon/probability_map_t.hpp"
#include "beckon/velocity_command_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "bot_core/pose_t.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

// Calls `on_invalid` before it throws.
Pose2 CheckedPose(const bot_core::pose_t& message, const std::function<void()>& on_invalid);
Call CallFromMessage(const call_t& message);
LocatedTag LocationFromMessage(const location_t& message);
Scan ScanFromMessage(const bot_core::planar_lidar_t& message);
PossibleArea AreaFromMessage(const probability_map_t& message);
SeenGrid GridFromMessage(const occupancy_grid_t& message);
velocity_command_t MessageFromVelocity(Utime utime, std::int64_t sequence,
                                       const Velocity& velocity);
navigator_status_t MessageFromStatus(Utime utime, const NavigatorStatus& status);

}  // namespace beckon
