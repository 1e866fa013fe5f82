// Runs the ground detector over sequences and reports how well it did.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "services/ground_detector/ground_detector.hpp"
#include "tools/evaluation/ground/scoring.hpp"

namespace beckon {

struct GroundEvaluationOptions {
  double max_range_m = 6.0;
  double max_speed_heights = 3.0;  // of what carries the camera, in camera heights a second
  std::filesystem::path overlay;   // folder for one picture a frame, empty for none
  std::set<DetectorPart> without;  // parts of the detector that are left out
};

// Throws ConfigError, FileError or std::invalid_argument, naming the file that cannot be used.
GroundScores EvaluateSequence(const std::filesystem::path& folder,
                              const GroundEvaluationOptions& options);

// One flat object for one sequence, a list of them for several, with the key "sequence" in each.
std::string ScoresAsJson(const std::vector<GroundScores>& scores);
// A column for each sequence.
std::string ScoresAsTable(const std::vector<GroundScores>& scores);

}  // namespace beckon
