// Table 3-1 of the thesis: how far away an object is, from 1.6 to 6.0 m, with the border of the
// ground at the picture's full scale and at one tenth of it.
#pragma once

#include <vector>

#include "tools/evaluation/thesis/walls_experiment.hpp"

namespace beckon {

// One distance, all trials. Errors are fractions of the true range, over the rays of the virtual
// scan that meet the object by truth and have a finite range.
struct RangeRow {
  double distance_m = 0.0;  // from the point below the camera to the object's face
  double error = 0.0;       // mean absolute
  double bias = 0.0;        // mean, positive: too far
  double worst = 0.0;       // largest absolute
  double missed = 0.0;      // share of rays without a range, or with one off by over 20 %
};

struct RangeTable {
  std::vector<RangeRow> rows;
  double ms_median = 0.0;  // a frame, decoding and ray casting included
  double ms_p95 = 0.0;
  // Mean of `error` over the rows of these distances, limits included.
  double MeanError(double from_m, double to_m) const;
};

struct RangeExperiment {
  RangeTable full;
  RangeTable tenth;  // borders of the cells that segmentation works on
};

// Each trial drives up to a box of random size and look in a random hall.
RangeExperiment RunRangeExperiment(const ExperimentOptions& options);

}  // namespace beckon
