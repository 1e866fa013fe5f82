#include "tools/rssi_calibration/radio_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/csv.hpp"
#include "common/statistics.hpp"
#include "services/rssi_localizer/localizer.hpp"

namespace beckon {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ResidualStatistics Describe(const std::vector<double>& residuals, int readings) {
  ResidualStatistics statistics{readings, static_cast<int>(residuals.size()), kNan, kNan, kNan,
                                kNan};
  if (residuals.empty()) return statistics;
  statistics.mean_db = Mean(residuals);
  statistics.sd_db = StandardDeviation(residuals);
  const double median = Quantile(residuals, 0.5);
  std::vector<double> deviations;
  for (const double residual : residuals) deviations.push_back(std::abs(residual - median));
  constexpr double kNormalMad = 1.4826;
  statistics.robust_sd_db = kNormalMad * Quantile(deviations, 0.5);
  const auto wild = std::count_if(deviations.begin(), deviations.end(), [&](double deviation) {
    return deviation > 3.0 * statistics.robust_sd_db;
  });
  statistics.wild_share = static_cast<double>(wild) / static_cast<double>(residuals.size());
  return statistics;
}

}  // namespace

RadioFit FitRadio(const std::filesystem::path& folder, const std::filesystem::path& own_readings) {
  RadioFit fit;
  fit.site = Site::Load(folder);
  const std::filesystem::path file = folder / "calibration.csv";
  std::vector<CalibrationReading> readings = LoadCalibration(file, fit.site);
  if (!own_readings.empty()) {
    const auto own = LoadRobotCalibration(own_readings, fit.site);
    readings.insert(readings.end(), own.begin(), own.end());
  }
  const SiteModel model = SiteModel::Fit(fit.site, readings, {});
  fit.choice = model.choice;
  const CalibrationSet calibration =
      CalibrationSet::Build(fit.site, readings, fit.choice.averaging);
  if (calibration.samples.empty()) throw FileError(file, "holds no readings to calibrate with");

  fit.path_loss = model.path_loss;

  const WallCounter walls(fit.site.plan);
  const std::size_t beacons = fit.site.beacons.size();
  std::vector<std::vector<double>> residuals(beacons);
  std::vector<double> all;
  std::vector<int> counts(beacons, 0);
  int all_counts = 0;
  for (const Beacon& beacon : fit.site.beacons)
    fit.beacons.push_back({beacon.id, 0.0, kNan, kNan, {}});
  for (const CalibrationSample& sample : calibration.samples) {
    const auto index = static_cast<std::size_t>(sample.beacon);
    const double crossed =
        fit.choice.parts.walls
            ? walls.Crossed(fit.site.beacons[index].position.head<2>(), sample.position)
            : 0.0;
    const double residual =
        sample.rssi_dbm - fit.path_loss.MeanRssi(sample.beacon, sample.distance_m, crossed);
    fit.samples.push_back({sample.beacon, sample.distance_m, residual});
    residuals[index].push_back(residual);
    all.push_back(residual);
    counts[index] += sample.readings;
    all_counts += sample.readings;
    BeaconFit& beacon = fit.beacons[index];
    beacon.nearest_m = std::fmin(beacon.nearest_m, sample.distance_m);
    beacon.farthest_m = std::fmax(beacon.farthest_m, sample.distance_m);
  }
  for (std::size_t i = 0; i < beacons; ++i) {
    if (!fit.path_loss.offset_db.empty()) fit.beacons[i].offset_db = fit.path_loss.offset_db[i];
    fit.beacons[i].residuals = Describe(residuals[i], counts[i]);
  }
  fit.residuals = Describe(all, all_counts);
  return fit;
}

}  // namespace beckon
