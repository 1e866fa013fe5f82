#include "tools/evaluation/localization/evaluate.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "common/csv.hpp"
#include "common/site.hpp"
#include "services/rssi_localizer/baselines.hpp"
#include "services/rssi_localizer/localizer.hpp"
#include "tools/evaluation/localization/oracle.hpp"

namespace beckon {
namespace {

// Of a place that a posterior takes for impossible, per m^2: keeps the mean log score finite.
constexpr double kLeastDensity = 1e-9;

// Readings of one tag in the order of time.
using ReadingsByTag = std::map<std::string, std::vector<BeaconReading>>;

ReadingsByTag SortByTag(const Site& site, const std::vector<Reading>& readings) {
  ReadingsByTag by_tag;
  for (const Reading& reading : readings) {
    by_tag[reading.tag].push_back(
        {reading.utime, site.BeaconIndex(reading.beacon), reading.rssi_dbm});
  }
  for (auto& [tag, of_tag] : by_tag) {
    std::stable_sort(of_tag.begin(), of_tag.end(),
                     [](const auto& a, const auto& b) { return a.utime < b.utime; });
  }
  return by_tag;
}

// Those with utime in (after, until].
std::vector<BeaconReading> Between(const std::vector<BeaconReading>& readings, Utime after,
                                   Utime until) {
  const auto later = [](Utime utime, const BeaconReading& reading) {
    return utime < reading.utime;
  };
  return {std::upper_bound(readings.begin(), readings.end(), after, later),
          std::upper_bound(readings.begin(), readings.end(), until, later)};
}

class Stopwatch {
 public:
  double Milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

class Evaluation {
 public:
  explicit Evaluation(const std::filesystem::path& folder, const EvaluationOptions& options)
      : site_(Site::Load(folder)),
        calibration_(LoadCalibration(folder / "calibration.csv", site_)),
        readings_(SortByTag(site_, LoadReadings(folder / "readings.csv", site_))),
        truth_(LoadTruth(folder / "truth.csv")) {
    if (truth_.empty()) throw FileError(folder / "truth.csv", "no epoch to judge");
    // Tracking is causal: epochs are judged in the order of time.
    std::stable_sort(truth_.begin(), truth_.end(),
                     [](const auto& a, const auto& b) { return a.utime < b.utime; });
    localizer_.grid.resolution_m = options.resolution_m;
    result_.site = site_.name;
    result_.epochs = static_cast<int>(truth_.size());
    const Utime window_us = UtimeFromSeconds(site_.window_s);
    if (std::filesystem::exists(folder / "generated.toml")) generated_ = folder / "generated.toml";
    for (const TruthEpoch& epoch : truth_) {
      window_.push_back(Between(readings_[epoch.tag], epoch.utime - window_us, epoch.utime));
      if (window_.back().empty()) ++result_.silent_epochs;
    }
  }

  SiteEvaluation Run() {
    const SiteModel filtered = Fit(MeasurementModelKind::kMapFiltered);
    result_.model = filtered.description;
    // What turns out to be the better mean is the rivals' as well.
    const Averaging averaging = filtered.choice.averaging;
    for (const auto& readings : window_) heard_.push_back(MeanPerBeacon(readings, averaging));
    const Baselines rivals(filtered.grid, site_,
                           CalibrationSet::Build(site_, calibration_, averaging), calibration_,
                           localizer_.prior);
    AddRival("area_centre", [&](const Heard&) { return rivals.AreaCentre(); });
    AddRival("weighted_centroid", [&](const Heard& h) { return rivals.WeightedCentroid(h); });
    AddRival("min_max", [&](const Heard& h) { return rivals.MinMax(h); });
    AddRival("rocrssi", [&](const Heard& h) { return rivals.Rocrssi(h); });
    AddRival("cc2431", [&](const Heard& h) { return rivals.Cc2431(h); });
    AddSingleEpoch("map_2d", Fit(MeasurementModelKind::kMap2d));
    AddSingleEpoch("map_filtered", filtered);
    AddTracking("tracking", filtered);
    if (generated_) AddOracle();
    return std::move(result_);
  }

 private:
  SiteModel Fit(MeasurementModelKind kind) {
    localizer_.model = kind;
    return SiteModel::Fit(site_, calibration_, localizer_);
  }

  void AddRival(const std::string& name,
                const std::function<Eigen::Vector2d(const Heard&)>& locate) {
    MethodErrors errors;
    for (std::size_t i = 0; i < truth_.size(); ++i) {
      const Stopwatch stopwatch;
      const Eigen::Vector2d position = locate(heard_[i]);
      errors.ms.push_back(stopwatch.Milliseconds());
      errors.error_m.push_back((position - truth_[i].position).norm());
    }
    result_.methods.emplace_back(name, std::move(errors));
  }

  void AddSingleEpoch(const std::string& name, const SiteModel& model) {
    MethodErrors errors;
    for (std::size_t i = 0; i < truth_.size(); ++i) {
      const Stopwatch stopwatch;
      const Heard heard = MeanPerBeacon(window_[i], model.choice.averaging);
      CellValues probability =
          LogLikelihood(model.model, heard, model.choice.trust, model.grid.size());
      NormaliseLog(probability);
      const Estimate estimate = Summarise(model.grid, probability);
      errors.ms.push_back(stopwatch.Milliseconds());
      Judge(model.grid, probability, estimate, truth_[i].position, errors);
    }
    result_.methods.emplace_back(name, std::move(errors));
  }

  void AddTracking(const std::string& name, const SiteModel& model) {
    MethodErrors errors;
    std::map<std::string, std::pair<TagTracker, Utime>> tags;
    for (const TruthEpoch& epoch : truth_) {
      std::vector<BeaconReading>& readings = readings_[epoch.tag];
      const auto [known, is_new] = tags.try_emplace(epoch.tag, TagTracker(model, localizer_),
                                                    std::numeric_limits<Utime>::min());
      auto& [tracker, utime] = known->second;
      const Stopwatch stopwatch;
      tracker.Advance(Between(readings, utime, epoch.utime), epoch.utime);
      const Estimate estimate = Summarise(model.grid, tracker.posterior());
      errors.ms.push_back(stopwatch.Milliseconds());
      utime = epoch.utime;
      Judge(model.grid, tracker.posterior().Dense(model.grid.size()), estimate, epoch.position,
            errors);
    }
    result_.methods.emplace_back(name, std::move(errors));
  }

  void AddOracle() {
    const Oracle oracle(site_, CalibrationSet::Build(site_, calibration_, Averaging::kDecibels),
                        *generated_);
    MethodErrors errors;
    for (std::size_t i = 0; i < truth_.size(); ++i) {
      const Stopwatch stopwatch;
      const CellValues probability = oracle.Probability(window_[i]);
      const Estimate estimate = Summarise(oracle.grid(), probability);
      errors.ms.push_back(stopwatch.Milliseconds());
      Judge(oracle.grid(), probability, estimate, truth_[i].position, errors);
    }
    result_.methods.emplace_back("oracle", std::move(errors));
  }

  static void Judge(const FloorGrid& grid, const CellValues& probability, const Estimate& estimate,
                    const Eigen::Vector2d& truth, MethodErrors& errors) {
    errors.error_m.push_back((estimate.mean - truth).norm());
    const auto cell = static_cast<std::size_t>(grid.NearestCell(truth));
    errors.inside_90.push_back(CredibleLevels(probability)[cell] < 0.9F ? 1 : 0);
    errors.area_90_m2.push_back(estimate.area_90_m2);
    const double density = static_cast<double>(probability[cell]) / grid.cell_area_m2();
    errors.log_score.push_back(std::log(std::max(density, kLeastDensity)));
  }

  Site site_;
  std::vector<CalibrationReading> calibration_;
  ReadingsByTag readings_;
  std::vector<TruthEpoch> truth_;
  LocalizerOptions localizer_;
  std::vector<std::vector<BeaconReading>> window_;  // per epoch
  std::vector<Heard> heard_;                        // per epoch
  std::optional<std::filesystem::path> generated_;  // of a simulated site
  SiteEvaluation result_;
};

}  // namespace

SiteEvaluation EvaluateSite(const std::filesystem::path& folder, const EvaluationOptions& options) {
  return Evaluation(folder, options).Run();
}

void MethodErrors::Append(const MethodErrors& other) {
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(error_m, other.error_m);
  append(ms, other.ms);
  append(inside_90, other.inside_90);
  append(area_90_m2, other.area_90_m2);
  append(log_score, other.log_score);
}

const MethodErrors* SiteEvaluation::Find(const std::string& name) const {
  for (const auto& [method, errors] : methods) {
    if (method == name) return &errors;
  }
  return nullptr;
}

SiteEvaluation Merge(const std::vector<SiteEvaluation>& sites) {
  SiteEvaluation all;
  // One simulated place whose readings were made again and again is still that place.
  const bool is_one_place =
      std::all_of(sites.begin(), sites.end(), [&](const SiteEvaluation& site) {
        return site.site == sites.front().site && site.is_simulated();
      });
  all.site = is_one_place ? sites.front().site : "all sites";
  for (const SiteEvaluation& site : sites) {
    all.epochs += site.epochs;
    all.silent_epochs += site.silent_epochs;
    for (const auto& [name, errors] : site.methods) {
      const auto known = std::find_if(all.methods.begin(), all.methods.end(),
                                      [&](const auto& method) { return method.first == name; });
      if (known != all.methods.end()) {
        known->second.Append(errors);
      } else {
        all.methods.emplace_back(name, errors);
      }
    }
  }
  return all;
}

}  // namespace beckon
