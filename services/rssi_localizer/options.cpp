#include "services/rssi_localizer/options.hpp"

#include <filesystem>
#include <map>

namespace beckon {

RssiLocalizerOptions ReadRssiLocalizerOptions(ConfigFile& file) {
  RssiLocalizerOptions options;
  ConfigTable& site = file.Table("site");
  std::filesystem::path folder;
  site.RequiredPath("folder", folder);
  options.site = Site::Load(folder);
  const std::filesystem::path calibration = folder / "calibration.csv";
  if (std::filesystem::exists(calibration)) {
    options.calibration = LoadCalibration(calibration, options.site);
  }

  ConfigTable& table = file.Table("rssi_localizer");
  LocalizerOptions& localizer = options.localizer;
  const std::map<std::string, MeasurementModelKind> models = {
      {"log_normal", MeasurementModelKind::kLogNormal},
      {"map_2d", MeasurementModelKind::kMap2d},
      {"map_filtered", MeasurementModelKind::kMapFiltered}};
  std::string model = "map_filtered";
  table.OptionalChoice("measurement_model", model, {"log_normal", "map_2d", "map_filtered"});
  localizer.model = models.at(model);
  if (localizer.model == MeasurementModelKind::kMap2d && options.calibration.empty()) {
    table.Fail("measurement_model",
               "map_2d needs calibration readings, and there are none in " + calibration.string());
  }
  table.Optional("rssi_at_1m_dbm", localizer.prior.rssi_at_1m_dbm, Range{-100.0, 0.0});
  table.Optional("path_loss_exponent", localizer.prior.exponent, Range{1.0, 6.0});
  table.Optional("rssi_sd_db", localizer.prior.sd_db, Range{1.0, 20.0});
  table.Optional("resolution_m", localizer.grid.resolution_m, Range{0.05, 5.0});
  table.Optional("max_cells", localizer.grid.max_cells, Range{100, 1e6});
  table.Optional("tracking", localizer.tracking);
  table.Optional("walk_m_per_sqrt_s", localizer.motion.walk_m_per_sqrt_s, Range{0.0, 5.0});
  table.Optional("lost_per_s", localizer.motion.lost_per_s, Range{0.0, 0.5});
  table.Optional("correlation_s", localizer.correlation_s, Range{0.0, 60.0});
  table.Optional("silent_after_s", localizer.silent_after_s, Range{0.1, 3600.0});
  table.Optional("forget_after_s", localizer.forget_after_s, Range{1.0, 86400.0});
  if (localizer.forget_after_s < localizer.silent_after_s) {
    table.Fail("forget_after_s", "has to be at least silent_after_s");
  }
  table.Optional("max_tags", localizer.max_tags, Range{1, 100000});
  table.Optional("update_period_s", options.update_period_s, Range{0.05, 60.0});
  table.Optional("maps_per_update", options.maps_per_update, Range{0, 1000});
  try {
    FloorGrid(options.site.plan, localizer.grid);
  } catch (const std::invalid_argument& error) {
    site.Fail("folder", error.what());
  }
  table.Optional("robot_tag", options.robot.robot_tag);
  if (table.Has("map_from_odometry")) {
    std::vector<double> start;
    table.Optional("map_from_odometry", start, 3);
    options.robot.map_from_odometry = Pose2{start[0], start[1], start[2]};
  }
  table.OptionalPath("own_readings", options.own_readings);
  if (!options.own_readings.empty() &&
      !std::filesystem::is_directory(options.own_readings.parent_path())) {
    table.Fail("own_readings", "there is no folder " + options.own_readings.parent_path().string());
  }
  if (std::filesystem::exists(options.own_readings)) {
    const auto own = LoadRobotCalibration(options.own_readings, options.site);
    options.known_own_readings = static_cast<int>(own.size());
    options.calibration.insert(options.calibration.end(), own.begin(), own.end());
  }
  return options;
}

}  // namespace beckon
