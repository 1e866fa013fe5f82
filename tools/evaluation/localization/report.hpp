// Tables and JSON of localization scores.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/localization/evaluate.hpp"

namespace beckon {

struct ErrorSummary {
  double mean = 0.0;
  double median = 0.0;
  double p95 = 0.0;
  double max = 0.0;
  double sd = 0.0;
};
// Of at least one value. Quantiles interpolate linearly between the two nearest values.
ErrorSummary SummariseErrors(const std::vector<double>& errors);

std::string Table(const SiteEvaluation& evaluation);

// One object for one site; for several {"sites": [object...], "all": object}.
std::string Json(const std::vector<SiteEvaluation>& sites);

}  // namespace beckon
