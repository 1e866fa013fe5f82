// Messages of navigator, to and from what its algorithms work on. Those that hold nonsense throw
// std::invalid_argument.
#pragma once

#include "beckon/call_t.hpp"
#include "beckon/location_t.hpp"
#include "beckon/navigator_status_t.hpp"
#include "beckon/occupancy_grid_t.hpp"
#include "beckon/velocity_command_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

Call CallFromMessage(const call_t& message);
LocatedTag LocationFromMessage(const location_t& message);
Scan ScanFromMessage(const bot_core::planar_lidar_t& message);
SeenGrid GridFromMessage(const occupancy_grid_t& message);
velocity_command_t MessageFromVelocity(Utime utime, std::int64_t sequence,
                                       const Velocity& velocity);
navigator_status_t MessageFromStatus(Utime utime, const NavigatorStatus& status);

}  // namespace beckon
