// The best that can be done with simulated readings: the posterior mean under the model, with the
// parameters, that generated them (generated.toml, which simulate_site writes).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "services/rssi_localizer/calibration_set.hpp"
#include "services/rssi_localizer/localizer.hpp"

namespace beckon {

class Oracle {
 public:
  // Knows path loss, walls, shadowing and fading; of the shadowing field itself it knows what the
  // calibration readings say (Gaussian process, exactly). Throws ConfigError for a bad file.
  Oracle(const Site& site, const CalibrationSet& calibration, const std::filesystem::path& file);

  const FloorGrid& grid() const { return grid_; }
  // Probability over the cells of grid(), given the readings of one window.
  CellValues Probability(const std::vector<BeaconReading>& readings) const;

 private:
  double ReadingVariance(double readings) const;

  FloorGrid grid_;
  double fading_sd_db_ = 0.0;
  double quantum_db_ = 0.0;
  Eigen::MatrixXd expected_dbm_;  // cell, beacon
  Eigen::MatrixXd variance_db2_;  // of the expected value: shadowing that is not known
};

}  // namespace beckon
