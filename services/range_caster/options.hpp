// What range_caster takes from the robot's configuration.
#pragma once

#include <chrono>

#include "services/range_caster/grid_mapper.hpp"
#include "services/range_caster/ray_caster.hpp"

namespace beckon {

struct RangeCasterOptions {
  GroundCamera camera;  // [camera] calibration
  RayCasterOptions rays;
  OccupancyMapOptions map;
  double grid_period_s = 0.2;  // between two GRID messages
};
RangeCasterOptions ReadRangeCasterOptions(ConfigFile& file);

}  // namespace beckon
