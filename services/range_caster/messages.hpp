// Messages of range_caster, to and from what its algorithms work on.
#pragma once

#include "beckon/ground_t.hpp"
#include "beckon/occupancy_grid_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "services/range_caster/grid_mapper.hpp"
#include "services/range_caster/ray_caster.hpp"

namespace beckon {

// Labels as a CV_8UC1 image. Throws std::invalid_argument for runs that do not fill the image.
cv::Mat LabelsFromMessage(const ground_t& message);
bot_core::planar_lidar_t MessageFromScan(Utime utime, const VirtualScan& scan);
occupancy_grid_t MessageFromMap(Utime utime, const OccupancyMap& map);

}  // namespace beckon
