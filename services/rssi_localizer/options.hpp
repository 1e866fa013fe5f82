// Configuration of rssi_localizer: tables [site] and [rssi_localizer].
#pragma once

#include <vector>

#include "common/config.hpp"
#include "common/frames.hpp"
#include "common/site.hpp"
#include "services/rssi_localizer/localizer.hpp"

namespace beckon {

struct RssiLocalizerOptions {
  Site site;
  std::vector<CalibrationReading> calibration;  // empty: the site has no calibration.csv
  LocalizerOptions localizer;
  Pose2 map_from_odometry;  // where the odometry frame starts in the map
  double update_period_s = 0.5;
  int maps_per_update = 4;  // LOCATION_MAP of so many tags each time, in turn
};

// Reads the site folder too. Throws ConfigError or FileError, naming file and line.
RssiLocalizerOptions ReadRssiLocalizerOptions(ConfigFile& file);

}  // namespace beckon
