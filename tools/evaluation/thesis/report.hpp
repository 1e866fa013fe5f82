// The experiments' results beside the thesis's numbers.
#pragma once

#include <string>

#include "tools/evaluation/thesis/range_experiment.hpp"
#include "tools/evaluation/thesis/walls_experiment.hpp"

namespace beckon {

std::string WallsAsTable(const std::vector<GroundScores>& trials);
std::string WallsAsJson(const std::vector<GroundScores>& trials);
std::string RangeAsTable(const RangeExperiment& experiment, int trials);
std::string RangeAsJson(const RangeExperiment& experiment, int trials);

}  // namespace beckon
