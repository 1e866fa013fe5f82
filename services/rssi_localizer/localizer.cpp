#include "services/rssi_localizer/localizer.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr Utime kFutureUs = 1'000'000;
// How long a location without new readings stands.
constexpr Utime kWalkOnUs = 1'000'000;
// A flood of readings of one tag is thinned here; the mean of 1000 says as much as that of more.
constexpr std::size_t kMaxReadingsPerTag = 1000;

std::chrono::microseconds Microseconds(double seconds) {
  return std::chrono::microseconds(UtimeFromSeconds(seconds));
}

ModelChoice Choose(const Site& site, const std::vector<CalibrationReading>& calibration,
                   const LocalizerOptions& options) {
  if (options.model == MeasurementModelKind::kMapFiltered) {
    return ChooseModel(site, calibration, options.prior);
  }
  ModelChoice choice;
  // Nothing is held back to judge what the robot heard by.
  choice.parts = {.offsets = true,
                  .walls = false,
                  .residual_map = false,
                  .bodies = false,
                  .histogram = false,
                  .by_robot = false};
  return choice;
}

}  // namespace

SiteModel SiteModel::Fit(const Site& site, const std::vector<CalibrationReading>& readings,
                         const LocalizerOptions& options) {
  ModelChoice choice = Choose(site, readings, options);
  const CalibrationSet calibration = CalibrationSet::Build(site, readings, choice.averaging);
  std::vector<Eigen::Vector2d> walked;
  for (const CalibrationSample& sample : calibration.samples) walked.push_back(sample.position);
  FloorGrid grid(site.plan, options.grid, walked);
  FittedModel fitted =
      BuildFittedModel(grid, site, calibration, choice.parts, options.prior, choice.kernel);
  std::string description = choice.Describe();
  if (calibration.samples.empty()) description += ", not calibrated: path loss as configured";
  if (options.model == MeasurementModelKind::kMap2d) {
    fitted.model = BuildMap2d(grid, site, calibration);
    description = "2-D map";
  }
  std::vector<int> representatives;
  for (const FloorGrid::Block& block : grid.blocks()) {
    representatives.push_back(block.representative);
  }
  MeasurementModel block_model = fitted.model.Restricted(representatives);
  return {site,
          std::move(grid),
          std::move(fitted.model),
          std::move(block_model),
          std::move(choice),
          fitted.path_loss,
          std::move(description)};
}

Heard MeanPerBeacon(const std::vector<BeaconReading>& readings, Averaging averaging) {
  std::map<int, RssiMean> means;
  for (const BeaconReading& reading : readings) {
    means.try_emplace(reading.beacon, averaging).first->second.Add(reading.rssi_dbm);
  }
  Heard heard;
  for (const auto& [beacon, mean] : means) heard.emplace_back(beacon, mean.rssi_dbm());
  return heard;
}

TagTracker::TagTracker(const SiteModel& model, const LocalizerOptions& options)
    : model_(model), correlation_s_(options.correlation_s), tracker_(model.grid, options.motion) {}

void TagTracker::Advance(std::vector<BeaconReading> readings, Utime utime) {
  std::stable_sort(readings.begin(), readings.end(),
                   [](const auto& a, const auto& b) { return a.utime < b.utime; });
  const Utime window_us = UtimeFromSeconds(model_.site.window_s);
  for (std::size_t first = 0; first < readings.size();) {
    const Utime end = readings[first].utime + window_us;
    std::size_t last = first;
    while (last < readings.size() && readings[last].utime < end) ++last;
    AddSlice({readings.begin() + static_cast<std::ptrdiff_t>(first),
              readings.begin() + static_cast<std::ptrdiff_t>(last)},
             readings[last - 1].utime);
    first = last;
  }
  PredictTo(utime);
}

void TagTracker::PredictTo(Utime utime) {
  if (utime_ && utime > *utime_) tracker_.Predict(SecondsFromUtime(utime - *utime_));
  utime_ = utime_ ? std::max(*utime_, utime) : utime;
}

void TagTracker::AddSlice(const std::vector<BeaconReading>& slice, Utime utime) {
  PredictTo(utime);
  const Heard heard = MeanPerBeacon(slice, model_.choice.averaging);
  std::vector<double> weight;
  for (const auto& [beacon, rssi] : heard) {
    const auto last = last_.find(beacon);
    const double age_s =
        last == last_.end() ? correlation_s_ : SecondsFromUtime(utime - last->second.utime);
    weight.push_back(correlation_s_ > 0.0 ? std::clamp(age_s / correlation_s_, 0.0, 1.0) : 1.0);
    // A late slice does not make the beacon's newest reading older.
    last_[beacon] = {last == last_.end() ? utime : std::max(utime, last->second.utime), beacon,
                     rssi};
  }

  // The strongest of the window, of which this slice may hold only a part.
  Heard in_window;
  const Utime begin = utime - UtimeFromSeconds(model_.site.window_s);
  std::erase_if(last_, [&](const auto& entry) {
    return SecondsFromUtime(utime - entry.second.utime) > std::max(correlation_s_, 60.0);
  });
  for (const auto& [beacon, last] : last_) {
    if (last.utime > begin) in_window.emplace_back(beacon, last.rssi_dbm);
  }
  const double least_rssi = LeastUsedRssi(in_window, model_.choice.trust);
  const auto for_each_used = [&](const auto& use) {
    for (std::size_t i = 0; i < heard.size(); ++i) {
      const auto& [beacon, rssi] = heard[i];
      if (rssi >= least_rssi) use(beacon, rssi, model_.choice.trust.temper * weight[i]);
    }
  };
  tracker_.Update(
      [&](std::span<const int> cells) {
        CellValues log_likelihood(cells.size(), 0.0F);
        for_each_used([&](int beacon, double rssi, double w) {
          model_.model.AddLogLikelihood(beacon, rssi, w, cells, log_likelihood);
        });
        return log_likelihood;
      },
      [&] {
        CellValues log_likelihood(model_.grid.blocks().size(), 0.0F);
        for_each_used([&](int beacon, double rssi, double w) {
          model_.block_model.AddLogLikelihood(beacon, rssi, w, log_likelihood);
        });
        return log_likelihood;
      });
}

Localizer::Localizer(SiteModel model, const LocalizerOptions& options)
    : model_(std::move(model)), options_(options) {
  for (std::size_t i = 0; i < model_.site.beacons.size(); ++i) {
    beacon_index_[model_.site.beacons[i].id] = static_cast<int>(i);
  }
}

Localizer::Verdict Localizer::Add(const Reading& reading, const Instant& now) {
  const auto beacon = beacon_index_.find(reading.beacon);
  if (beacon == beacon_index_.end()) return Verdict::kUndeclaredBeacon;
  if (!IsPlausibleRssi(reading.rssi_dbm) || reading.tag.empty() || reading.utime < 0) {
    return Verdict::kImplausible;
  }
  if (reading.utime > now.utime + kFutureUs) return Verdict::kFuture;
  auto known = tags_.find(reading.tag);
  if (known == tags_.end()) {
    if (tags_.size() >= static_cast<std::size_t>(options_.max_tags)) return Verdict::kTooManyTags;
    known = tags_.try_emplace(reading.tag).first;
    known->second.newest = reading.utime;
  }
  Tag& tag = known->second;
  const Utime window_us = UtimeFromSeconds(model_.site.window_s);
  if (reading.utime <= tag.newest - window_us) return Verdict::kLate;
  if (reading.utime >= tag.newest) {
    tag.newest = reading.utime;
    tag.newest_arrival = now.steady;
  }
  const BeaconReading added{reading.utime, beacon->second, reading.rssi_dbm};
  for (std::vector<BeaconReading>* list : {&tag.window, &tag.pending}) {
    if (list->size() < kMaxReadingsPerTag) list->push_back(added);
  }
  return Verdict::kAccepted;
}

bool Localizer::IsExplained(const Heard& heard, const SparsePosterior& posterior) const {
  // Outside, a reading may have any value of 100 dB.
  const double outside = std::log(0.01) * static_cast<double>(heard.size());
  const auto is_explained_at = [&](int cell) {
    double there = 0.0;
    for (const auto& [beacon, rssi] : heard) {
      there += model_.model.LogLikelihoodAt(beacon, rssi, cell);
    }
    return there >= outside;
  };
  // The likeliest cell mostly settles it, and saves looking at all of them.
  const auto likeliest =
      std::max_element(posterior.probability.begin(), posterior.probability.end());
  if (likeliest != posterior.probability.end() &&
      is_explained_at(posterior.cells[static_cast<std::size_t>(
          std::distance(posterior.probability.begin(), likeliest))])) {
    return true;
  }
  return std::any_of(posterior.cells.begin(), posterior.cells.end(), is_explained_at) ||
         std::any_of(model_.grid.blocks().begin(), model_.grid.blocks().end(),
                     [&](const FloorGrid::Block& b) { return is_explained_at(b.representative); });
}

void Localizer::Locate(const std::string& name, Tag& tag, Utime utime) {
  const Heard heard = MeanPerBeacon(tag.window, model_.choice.averaging);
  TagLocation& location = tag.location;
  if (options_.tracking) {
    if (!tag.tracker) tag.tracker.emplace(model_, options_);
    tag.tracker->Advance(std::move(tag.pending), utime);
    location.posterior = tag.tracker->posterior();
  } else if (!heard.empty()) {
    CellValues probability =
        LogLikelihood(model_.model, heard, model_.choice.trust, model_.grid.size());
    NormaliseLog(probability);
    location.posterior = SparsePosterior::From(std::move(probability));
  }
  tag.pending.clear();
  location.tag = name;
  location.utime = tag.newest;
  location.estimate = Summarise(model_.grid, location.posterior);
  if (heard.empty()) return;
  location.beacons = static_cast<int>(heard.size());
  location.readings = static_cast<int>(tag.window.size());
  location.status = IsExplained(heard, location.posterior) ? TagLocation::Status::kOk
                                                           : TagLocation::Status::kOutside;
}

std::vector<TagLocation> Localizer::Update(const Instant& now) {
  const double silent_after_s = std::max(options_.silent_after_s, model_.site.window_s);
  const Utime window_us = UtimeFromSeconds(model_.site.window_s);
  std::vector<TagLocation> locations;
  for (auto entry = tags_.begin(); entry != tags_.end();) {
    Tag& tag = entry->second;
    const std::chrono::microseconds age = now.steady - tag.newest_arrival;
    if (age > Microseconds(options_.forget_after_s)) {
      entry = tags_.erase(entry);
      continue;
    }
    const Utime utime = tag.newest + age.count();
    std::erase_if(tag.window, [&](const BeaconReading& reading) {
      return reading.utime <= tag.newest - window_us;
    });
    // Between readings it can only walk on, which need not be worked out all the time.
    if (!tag.pending.empty() || !tag.located || utime >= *tag.located + kWalkOnUs) {
      Locate(entry->first, tag, utime);
      tag.located = utime;
    }
    locations.push_back(tag.location);
    if (age > Microseconds(silent_after_s)) {
      locations.back().status = TagLocation::Status::kSilent;
    }
    ++entry;
  }
  return locations;
}

}  // namespace beckon
