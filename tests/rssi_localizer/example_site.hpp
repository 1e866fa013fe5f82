// A made-up place and readings in it that follow the log-normal model exactly.
#pragma once

#include <random>

#include "services/rssi_localizer/calibration_set.hpp"
#include "services/rssi_localizer/path_loss.hpp"

namespace beckon::testing {

// An empty room of 10 x 8 m with a beacon in each corner, "a" to "d", and one in the middle, "e".
inline Site ExampleSite() {
  Site site;
  site.name = "example";
  site.plan.min = {0.0, 0.0};
  site.plan.max = {10.0, 8.0};
  site.beacons = {{"a", {0.0, 0.0, 2.0}},
                  {"b", {10.0, 0.0, 2.0}},
                  {"c", {10.0, 8.0, 2.0}},
                  {"d", {0.0, 8.0, 2.0}},
                  {"e", {5.0, 4.0, 2.0}}};
  site.tag_height_m = 1.0;
  site.window_s = 1.0;
  return site;
}

inline PathLoss ExamplePathLoss() {
  PathLoss path_loss;
  path_loss.rssi_at_1m_dbm = -50.0;
  path_loss.exponent = 2.2;
  path_loss.sd_db = 4.0;
  return path_loss;
}

// One reading of each beacon a second at places spread evenly over the area.
inline std::vector<CalibrationReading> ExampleCalibration(const Site& site,
                                                          const PathLoss& path_loss, int places,
                                                          double sd_db, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(site.plan.min.x(), site.plan.max.x());
  std::uniform_real_distribution<double> y(site.plan.min.y(), site.plan.max.y());
  std::normal_distribution<double> noise(0.0, 1.0);
  const WallCounter walls(site.plan);
  std::vector<CalibrationReading> readings;
  for (int i = 0; i < places; ++i) {
    const Eigen::Vector2d position(x(random), y(random));
    for (std::size_t b = 0; b < site.beacons.size(); ++b) {
      const Beacon& beacon = site.beacons[b];
      const double mean = path_loss.MeanRssi(static_cast<int>(b),
                                             BeaconDistance(beacon, site.tag_height_m, position),
                                             walls.Crossed(beacon.position.head<2>(), position));
      readings.push_back(
          {{i * 2'000'000LL, "tag", beacon.id, mean + sd_db * noise(random)}, position});
    }
  }
  return readings;
}

}  // namespace beckon::testing
