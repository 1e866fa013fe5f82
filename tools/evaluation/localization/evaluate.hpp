// Scores localization methods on a recorded site.
//
// Models are fitted on calibration.csv alone. For each row of truth.csv a method gets the readings
// of that tag with utime in (t - window_s, t], one mean RSSI per beacon; tracking gets all readings
// up to t. Error is the Euclidean distance in the plane. An epoch with nothing heard is judged like
// any other: the rivals then answer the area centre, the grid methods the mean of their prior.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace beckon {

struct MethodErrors {
  std::vector<double> error_m;  // per epoch
  std::vector<double> ms;       // milliseconds per update
  // Of the methods that have a posterior: whether the truth was in the 90 % area, and its size.
  std::vector<char> inside_90;
  std::vector<double> area_90_m2;
  std::vector<double> log_score;  // log of the probability density at the truth, per m^2

  void Append(const MethodErrors& other);
};

struct SiteEvaluation {
  std::string site;
  int epochs = 0;
  int silent_epochs = 0;  // epochs with no reading in the window
  std::string model;      // what the filtered map consists of, as chosen on held-back readings
  std::vector<std::pair<std::string, MethodErrors>> methods;  // in the order of the table

  // Null for a method that was not run.
  const MethodErrors* Find(const std::string& name) const;
  // Whether it is known how the readings were made.
  bool is_simulated() const { return Find("oracle") != nullptr; }
};

struct EvaluationOptions {
  double resolution_m = 0.25;  // of the grid
};

// Throws FileError or ConfigError, naming file and line.
SiteEvaluation EvaluateSite(const std::filesystem::path& folder, const EvaluationOptions& options);

// All epochs of several sites as if they were one.
SiteEvaluation Merge(const std::vector<SiteEvaluation>& sites);

}  // namespace beckon
