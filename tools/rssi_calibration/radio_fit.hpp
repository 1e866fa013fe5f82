// What the calibration readings of a place say of its radio: the model that rssi_localizer will fit
// there, and how far each reading is from it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/site.hpp"
#include "services/rssi_localizer/calibration_set.hpp"
#include "services/rssi_localizer/model_selection.hpp"
#include "services/rssi_localizer/path_loss.hpp"

namespace beckon {

// Of measured minus expected RSSI, dB; NaN where there are no samples.
struct ResidualStatistics {
  int readings = 0;
  int samples = 0;  // means over an evaluation window, which are what the model is fitted to
  double mean_db = 0.0;
  double sd_db = 0.0;
  double robust_sd_db = 0.0;  // 1.4826 times the median absolute deviation from the median
  double wild_share = 0.0;  // of the samples: farther than three robust deviations from the median
};

struct BeaconFit {
  std::string id;
  double offset_db = 0.0;  // of this beacon's power above that of all; 0 where that is not a part
  double nearest_m = 0.0;  // between which distances it was heard; NaN where it never was
  double farthest_m = 0.0;
  ResidualStatistics residuals;
};

// One sample, measured minus expected.
struct FittedSample {
  int beacon = 0;  // index in the site
  double distance_m = 0.0;
  double residual_db = 0.0;
};

struct RadioFit {
  Site site;
  ModelChoice choice;
  PathLoss path_loss;
  ResidualStatistics residuals;    // of all beacons together
  std::vector<BeaconFit> beacons;  // in the site's order
  std::vector<FittedSample> samples;
};

// Fits as rssi_localizer does at its start; residuals are those of the path loss with its offsets
// and walls, before the residual map. Reads FOLDER/site.toml and FOLDER/calibration.csv. Throws
// ConfigError or FileError naming file, line and key; FileError for a calibration without readings.
RadioFit FitRadio(const std::filesystem::path& folder,
                  const std::filesystem::path& own_readings = {});

}  // namespace beckon
