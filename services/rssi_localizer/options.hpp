// Configuration of rssi_localizer: tables [site] and [rssi_localizer].
#pragma once

#include <filesystem>
#include <vector>

#include "common/config.hpp"
#include "common/site.hpp"
#include "services/rssi_localizer/localizer.hpp"
#include "services/rssi_localizer/robot_localizer.hpp"

namespace beckon {

struct RssiLocalizerOptions {
  Site site;
  std::vector<CalibrationReading> calibration;  // empty: the site has no calibration.csv
  LocalizerOptions localizer;
  RobotLocalizerOptions robot;
  std::filesystem::path own_readings;  // file that the robot calibrates itself with; empty: none
  int known_own_readings = 0;          // that it holds, which are in `calibration`
  double update_period_s = 0.5;
  int maps_per_update = 4;  // LOCATION_MAP of so many tags each time, in turn
};

// Reads the site folder too. Throws ConfigError or FileError, naming file and line.
RssiLocalizerOptions ReadRssiLocalizerOptions(ConfigFile& file);

}  // namespace beckon
