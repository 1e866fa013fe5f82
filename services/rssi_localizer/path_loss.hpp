// The log-normal model: RSSI falls with the logarithm of distance, with noise of constant spread in
// dB.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/floor_plan.hpp"
#include "services/rssi_localizer/calibration_set.hpp"

namespace beckon {

// rssi = rssi_at_1m_dbm - 10 exponent log10(distance / 1 m) + offset_db[beacon] - wall_db * walls
// crossed.
struct PathLoss {
  double rssi_at_1m_dbm = -45.0;
  double exponent = 2.5;
  double sd_db = 7.0;
  double wall_db = 0.0;           // attenuation of each face that the straight line crosses
  std::vector<double> offset_db;  // per beacon; empty: none

  double MeanRssi(double distance_m) const;
  double MeanRssi(int beacon, double distance_m, double walls_crossed) const;
  // The distance at which MeanRssi(distance) is this, m.
  double Distance(double rssi_dbm) const;
};

struct PathLossFitOptions {
  // What is expected before anything is measured, and how firmly: the standard deviations keep a
  // fit to few places from running away, and vanish beside many.
  PathLoss prior;
  double rssi_at_1m_sd_db = 15.0;
  double exponent_sd = 0.7;
  double offset_sd_db = 4.0;
  double wall_sd_db = 4.0;
  bool fit_offsets = true;
};

// Fits by iteratively reweighted least squares with Student-t weights (4 degrees of freedom), so
// that a tenth of wild readings does no harm. `walls_crossed`: per sample; empty: walls are not
// part of the model. No samples: the prior.
PathLoss FitPathLoss(std::span<const CalibrationSample> samples, int beacons,
                     std::span<const double> walls_crossed, const PathLossFitOptions& options);

// Number of wall faces (walls and edges of the outline, not furniture) on the straight line from a
// beacon to a tag; both ends are drawn in by 5 cm, as beacons hang on walls.
class WallCounter {
 public:
  explicit WallCounter(const FloorPlan& plan);
  bool has_walls() const { return !walls_.empty(); }
  double Crossed(const Eigen::Vector2d& beacon, const Eigen::Vector2d& tag) const;

 private:
  std::vector<Wall> walls_;
};

}  // namespace beckon
