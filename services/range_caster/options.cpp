#include "services/range_caster/options.hpp"

#include <filesystem>

namespace beckon {

RangeCasterOptions ReadRangeCasterOptions(ConfigFile& file) {
  RangeCasterOptions options;
  std::filesystem::path calibration;
  file.Table("camera").RequiredPath("calibration", calibration);
  options.camera = GroundCamera::Load(calibration);

  ConfigTable& table = file.Table("range_caster");
  ReadRayCasterOptions(table, options.rays);
  ReadOccupancyMapOptions(table, options.map);
  table.Optional("grid_period_s", options.grid_period_s, Range{0.05, 10.0});
  try {
    RayCaster(options.camera, options.rays);
  } catch (const std::invalid_argument& error) {
    table.Fail("max_range_m", error.what());
  }
  return options;
}

}  // namespace beckon
