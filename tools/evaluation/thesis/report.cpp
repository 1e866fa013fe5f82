#include "tools/evaluation/thesis/report.hpp"

#include <nlohmann/json.hpp>

#include "common/text.hpp"

namespace beckon {
namespace {

constexpr double kThesisFeatureFalseRate = 0.0084;
constexpr double kThesisRegionFalseRate = 0.0291;

nlohmann::ordered_json TableAsJson(const RangeTable& table) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const RangeRow& row : table.rows) {
    rows.push_back({{"distance_m", row.distance_m},
                    {"error", row.error},
                    {"bias", row.bias},
                    {"worst", row.worst},
                    {"missed", row.missed}});
  }
  return {{"error_1.6_to_4.8_m", table.MeanError(1.6, 4.8)},
          {"error_5.2_to_6.0_m", table.MeanError(5.2, 6.0)},
          {"ms_median", table.ms_median},
          {"ms_p95", table.ms_p95},
          {"rows", rows}};
}

}  // namespace

std::string WallsAsTable(const std::vector<GroundScores>& trials) {
  const WallsSummary summary = SummariseWalls(trials);
  std::string text = Format(
      "Section 3.5: three walls and a floor of one random texture, random path; %zu trials of %d "
      "views, %%\n                                  thesis   Beckon\n",
      trials.size(), kWallsViews);
  text += Format("feature false rate, mean          %6.2f   %6.2f   (of %.1f nothing is said)\n",
                 100.0 * kThesisFeatureFalseRate, 100.0 * summary.feature_false_rate,
                 100.0 * summary.feature_undetermined);
  text += Format("region false rate, mean           %6.2f   %6.2f   (undetermined %.2f)\n",
                 100.0 * kThesisRegionFalseRate, 100.0 * summary.region_false_rate,
                 100.0 * summary.undetermined);
  text += Format("region false rate, worst frame         -   %6.2f\n",
                 100.0 * summary.region_false_rate_worst);
  text += Format("range error, mean                      -   %6.2f\n", 100.0 * summary.range_error);
  text += Format("ms a frame, median                     -   %6.1f\n", summary.ms);
  return text;
}

std::string WallsAsJson(const std::vector<GroundScores>& trials) {
  const WallsSummary summary = SummariseWalls(trials);
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const GroundScores& trial : trials) {
    nlohmann::ordered_json object = {{"name", trial.sequence}};
    for (const auto& [name, value] : trial.values) object[name] = value;
    list.push_back(std::move(object));
  }
  return nlohmann::ordered_json{{"experiment", "walls"},
                                {"trials", trials.size()},
                                {"views", kWallsViews},
                                {"feature_false_rate_mean", summary.feature_false_rate},
                                {"feature_undetermined_mean", summary.feature_undetermined},
                                {"region_false_rate_mean", summary.region_false_rate},
                                {"region_false_rate_max", summary.region_false_rate_worst},
                                {"undetermined", summary.undetermined},
                                {"range_error_mean", summary.range_error},
                                {"ms_median", summary.ms},
                                {"thesis",
                                 {{"feature_false_rate_mean", kThesisFeatureFalseRate},
                                  {"region_false_rate_mean", kThesisRegionFalseRate}}},
                                {"each", list}}
             .dump() +
         "\n";
}

std::string RangeAsTable(const RangeExperiment& experiment, int trials) {
  std::string text = Format(
      "Table 3-1: an object on the floor, 640 x 480, %d trials; range error in %%\n"
      "              full scale                      one tenth scale\n"
      "  distance    mean    bias   worst  missed     mean    bias   worst  missed\n",
      trials);
  for (std::size_t i = 0; i < experiment.full.rows.size(); ++i) {
    const RangeRow& full = experiment.full.rows[i];
    const RangeRow& tenth = experiment.tenth.rows[i];
    text += Format("  %5.1f m   %6.2f  %+6.2f  %6.2f  %6.2f   %6.2f  %+6.2f  %6.2f  %6.2f\n",
                   full.distance_m, 100.0 * full.error, 100.0 * full.bias, 100.0 * full.worst,
                   100.0 * full.missed, 100.0 * tenth.error, 100.0 * tenth.bias,
                   100.0 * tenth.worst, 100.0 * tenth.missed);
  }
  const auto summary = [&](double from_m, double to_m, const char* thesis) {
    text += Format("  %.1f - %.1f m %5.2f %32.2f   thesis: %s\n", from_m, to_m,
                   100.0 * experiment.full.MeanError(from_m, to_m),
                   100.0 * experiment.tenth.MeanError(from_m, to_m), thesis);
  };
  summary(1.6, 4.8, "within 3 %");
  summary(5.2, 6.0, "more");
  text += Format("  ms a frame: median %.1f, p95 %.1f; one tenth scale: median %.1f, p95 %.1f\n",
                 experiment.full.ms_median, experiment.full.ms_p95, experiment.tenth.ms_median,
                 experiment.tenth.ms_p95);
  return text;
}

std::string RangeAsJson(const RangeExperiment& experiment, int trials) {
  return nlohmann::ordered_json{{"experiment", "range"},
                                {"trials", trials},
                                {"full", TableAsJson(experiment.full)},
                                {"tenth", TableAsJson(experiment.tenth)},
                                {"thesis", {{"error_1.6_to_4.8_m", 0.03}}}}
             .dump() +
         "\n";
}

}  // namespace beckon
