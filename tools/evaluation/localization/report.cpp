#include "tools/evaluation/localization/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

namespace beckon {
namespace {

double Quantile(const std::vector<double>& sorted, double q) {
  const double at = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double fraction = at - static_cast<double>(below);
  return (1.0 - fraction) * sorted[below] + fraction * sorted[above];
}

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double Coverage(const MethodErrors& errors) {
  return static_cast<double>(std::count(errors.inside_90.begin(), errors.inside_90.end(), 1)) /
         static_cast<double>(errors.inside_90.size());
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return Quantile(values, 0.5);
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
      method["area_90_m2"] = Median(errors.area_90_m2);
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

ErrorSummary SummariseErrors(std::vector<double> errors) {
  if (errors.empty()) throw std::invalid_argument("no errors to summarise");
  std::sort(errors.begin(), errors.end());
  ErrorSummary summary;
  summary.mean = Mean(errors);
  summary.median = Quantile(errors, 0.5);
  summary.p95 = Quantile(errors, 0.95);
  summary.max = errors.back();
  double squares = 0.0;
  for (const double error : errors) squares += (error - summary.mean) * (error - summary.mean);
  summary.sd = std::sqrt(squares / static_cast<double>(errors.size()));
  return summary;
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
                    Median(errors.area_90_m2), Mean(errors.log_score));
      text += line;
    }
    text += '\n';
  }
  return text;
}

std::string Json(const std::vector<SiteEvaluation>& sites) {
  if (sites.size() == 1) return JsonOf(sites.front()).dump(1);
  nlohmann::json all = {{"sites", nlohmann::json::array()}, {"all", JsonOf(Merge(sites))}};
  for (const SiteEvaluation& site : sites) all["sites"].push_back(JsonOf(site));
  return all.dump(1);
}

}  // namespace beckon
