// Section 3.5 of the thesis: three walls and a floor of one random texture, a robot on a random
// path. Colour cannot tell what is floor; only motion can.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <vector>

#include "tools/evaluation/ground/scoring.hpp"

namespace beckon {

struct ExperimentOptions {
  int trials = 100;
  std::uint64_t seed = 1;          // of the first trial; the next ones count on
  std::filesystem::path pictures;  // folder for pictures, empty for none
  std::set<DetectorPart> without;  // parts of the detector that are left out
};

// Views of each trial that are judged, after the ones that start the matching.
inline constexpr int kWallsViews = 10;

// Scores of each trial.
std::vector<GroundScores> RunWallsExperiment(const ExperimentOptions& options);

// Means over trials, except the worst frame, which is that of all; fractions.
struct WallsSummary {
  double feature_false_rate = 0.0;
  double feature_undetermined = 0.0;  // matched features of which nothing is said
  double region_false_rate = 0.0;
  double region_false_rate_worst = 0.0;
  double undetermined = 0.0;  // pixels
  double range_error = 0.0;
  double ms = 0.0;
};
WallsSummary SummariseWalls(const std::vector<GroundScores>& trials);

}  // namespace beckon
