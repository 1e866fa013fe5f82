#include "tools/evaluation/localization/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/statistics.hpp"
#include "common/text.hpp"

namespace beckon {
namespace {

double Coverage(const MethodErrors& errors) {
  return static_cast<double>(std::count(errors.inside_90.begin(), errors.inside_90.end(), 1)) /
         static_cast<double>(errors.inside_90.size());
}

// What Lin and Song report of their places; NaN where their figure is not at hand.
struct ThesisPlace {
  const char* site;
  const char* table;
  double min_max_m;
  double map_over_min_max;  // mean error of their probability map over that of Min-Max
};
constexpr std::array kThesisPlaces = {
    ThesisPlace{"EE1", "Table 2-2", 2.29, std::numeric_limits<double>::quiet_NaN()},
    ThesisPlace{"EE2", "Table 2-3", 2.46, 0.49}, ThesisPlace{"EE3", "Table 2-4", 3.70, 0.37}};

std::string Cell(double value) { return std::isnan(value) ? "       -" : Format("%8.2f", value); }

// In the thesis's form, beside its own figures, for its places as simulate_site makes them; else
// empty.
std::string ThesisTable(const SiteEvaluation& evaluation) {
  const auto place =
      std::find_if(kThesisPlaces.begin(), kThesisPlaces.end(),
                   [&](const ThesisPlace& known) { return known.site == evaluation.site; });
  const MethodErrors* const min_max = evaluation.Find("min_max");
  if (place == kThesisPlaces.end() || !min_max || !evaluation.is_simulated()) return "";
  std::string text = Format("\n%s of the thesis, %s\n", place->table, place->site) +
                     "                  mean m  sd m   of Min-Max   thesis: mean m   of Min-Max\n";
  const double reference = Mean(min_max->error_m);
  for (const auto& [name, errors] : evaluation.methods) {
    const ErrorSummary summary = SummariseErrors(errors.error_m);
    const double ratio = name == "min_max"        ? 1.0
                         : name == "map_filtered" ? place->map_over_min_max
                                                  : std::numeric_limits<double>::quiet_NaN();
    text += Format("%-16s%8.2f%6.2f%13.2f", name.c_str(), summary.mean, summary.sd,
                   summary.mean / reference) +
            "         " + Cell(ratio * place->min_max_m) + "     " + Cell(ratio) + "\n";
  }
  return text;
}

nlohmann::json JsonOf(const SiteEvaluation& evaluation) {
  nlohmann::json methods = nlohmann::json::object();
  for (const auto& [name, errors] : evaluation.methods) {
    const ErrorSummary summary = SummariseErrors(errors.error_m);
    nlohmann::json method = {{"mean", summary.mean}, {"median", summary.median},
                             {"p95", summary.p95},   {"max", summary.max},
                             {"sd", summary.sd},     {"ms", Mean(errors.ms)}};
    if (!errors.inside_90.empty()) {
      method["coverage_90"] = Coverage(errors);
      method["area_90_m2"] = Quantile(errors.area_90_m2, 0.5);
      method["log_score"] = Mean(errors.log_score);
    }
    methods[name] = std::move(method);
  }
  return {{"site", evaluation.site},
          {"epochs", evaluation.epochs},
          {"silent_epochs", evaluation.silent_epochs},
          {"model", evaluation.model},
          {"methods", std::move(methods)}};
}

}  // namespace

ErrorSummary SummariseErrors(const std::vector<double>& errors) {
  if (errors.empty()) throw std::invalid_argument("no errors to summarise");
  return {Mean(errors), Quantile(errors, 0.5), Quantile(errors, 0.95), Quantile(errors, 1.0),
          StandardDeviation(errors)};
}

std::string Table(const SiteEvaluation& evaluation) {
  std::string text = evaluation.site + ": " + std::to_string(evaluation.epochs) + " epochs";
  if (evaluation.silent_epochs > 0) {
    text += ", " + std::to_string(evaluation.silent_epochs) + " of them with nothing heard";
  }
  if (!evaluation.model.empty()) text += "\nmap_filtered is: " + evaluation.model;
  text +=
      "\nmethod               mean   median      p95      max       sd   ms/update   in 90 % area"
      "   90 % area   log score\n"
      "                        m        m        m        m        m"
      "                              m2      per m2\n";
  for (const auto& [name, errors] : evaluation.methods) {
    const ErrorSummary summary = SummariseErrors(errors.error_m);
    char line[200];
    std::snprintf(line, sizeof line, "%-16s %8.3f %8.3f %8.3f %8.3f %8.3f %11.4f", name.c_str(),
                  summary.mean, summary.median, summary.p95, summary.max, summary.sd,
                  Mean(errors.ms));
    text += line;
    if (!errors.inside_90.empty()) {
      std::snprintf(line, sizeof line, " %14.3f %11.1f %11.3f", Coverage(errors),
                    Quantile(errors.area_90_m2, 0.5), Mean(errors.log_score));
      text += line;
    }
    text += '\n';
  }
  return text + ThesisTable(evaluation);
}

std::string Json(const std::vector<SiteEvaluation>& sites) {
  if (sites.size() == 1) return JsonOf(sites.front()).dump(1);
  nlohmann::json all = {{"sites", nlohmann::json::array()}, {"all", JsonOf(Merge(sites))}};
  for (const SiteEvaluation& site : sites) all["sites"].push_back(JsonOf(site));
  return all.dump(1);
}

}  // namespace beckon
