#include "services/rssi_localizer/calibration_set.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace beckon {
namespace {

struct Mean {
  RssiMean rssi;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
};

void CloseWindow(const Site& site, std::map<int, Mean>& window, Utime utime, int tag, Origin origin,
                 CalibrationSet& set) {
  if (window.empty()) return;
  const int epoch = static_cast<int>(set.epochs.size());
  CalibrationEpoch& added = set.epochs.emplace_back();
  added.utime = utime;
  added.tag = tag;
  added.origin = origin;
  int readings = 0;
  for (const auto& [beacon, mean] : window) {
    const int count = mean.rssi.count();
    added.position += mean.position;
    readings += count;
    CalibrationSample& sample = set.samples.emplace_back();
    sample.beacon = beacon;
    sample.rssi_dbm = mean.rssi.rssi_dbm();
    sample.position = mean.position / count;
    sample.distance_m = BeaconDistance(site.beacons[static_cast<std::size_t>(beacon)],
                                       site.tag_height_m, sample.position);
    sample.readings = count;
    sample.epoch = epoch;
    sample.origin = origin;
    added.heard.emplace_back(beacon, sample.rssi_dbm);
  }
  added.position /= readings;
  window.clear();
}

void WeighByPlace(std::vector<CalibrationSample>& samples) {
  std::map<std::tuple<int, long, long>, int> count;
  const auto place = [](const CalibrationSample& sample) {
    return std::make_tuple(sample.beacon, std::lround(std::floor(sample.position.x())),
                           std::lround(std::floor(sample.position.y())));
  };
  for (const CalibrationSample& sample : samples) ++count[place(sample)];
  for (CalibrationSample& sample : samples) {
    sample.weight = std::min(1.0, CalibrationSet::kMaxWeightPerPlace / count[place(sample)]);
  }
}

}  // namespace

void RssiMean::Add(double rssi_dbm) {
  sum_ += averaging_ == Averaging::kPower ? std::pow(10.0, 0.1 * rssi_dbm) : rssi_dbm;
  ++count_;
}

double RssiMean::rssi_dbm() const {
  const double mean = sum_ / count_;
  return averaging_ == Averaging::kPower ? 10.0 * std::log10(mean) : mean;
}

double BeaconDistance(const Beacon& beacon, double tag_height_m, const Eigen::Vector2d& position) {
  const Eigen::Vector3d tag(position.x(), position.y(), tag_height_m);
  return std::max(kMinDistanceM, (beacon.position - tag).norm());
}

CalibrationSet CalibrationSet::Build(const Site& site,
                                     const std::vector<CalibrationReading>& readings,
                                     Averaging averaging) {
  // What the robot recorded stands apart from what was surveyed with the same tag.
  std::map<std::pair<std::string, bool>, std::vector<const CalibrationReading*>> by_tag;
  for (const CalibrationReading& reading : readings) {
    if (IsPlausibleRssi(reading.reading.rssi_dbm))
      by_tag[{reading.reading.tag, reading.by_robot}].push_back(&reading);
  }
  std::map<std::string, int> beacon_index;
  for (std::size_t i = 0; i < site.beacons.size(); ++i) {
    beacon_index[site.beacons[i].id] = static_cast<int>(i);
  }

  CalibrationSet set;
  const Utime window_us = UtimeFromSeconds(site.window_s);
  int tag_number = 0;
  for (auto& [tag, of_tag] : by_tag) {
    std::stable_sort(of_tag.begin(), of_tag.end(), [](const auto* a, const auto* b) {
      return a->reading.utime < b->reading.utime;
    });
    Origin origin = Origin::kSurvey;
    if (tag.second) {
      origin = Origin::kRobot;
    } else if (beacon_index.contains(tag.first)) {
      origin = Origin::kBeacons;
    }
    std::map<int, Mean> window;
    Utime window_end = 0;
    const CalibrationReading* last = nullptr;
    for (const CalibrationReading* reading : of_tag) {
      const auto beacon = beacon_index.find(reading->reading.beacon);
      if (beacon == beacon_index.end()) continue;
      if (!last || reading->reading.utime >= window_end) {
        if (last) CloseWindow(site, window, last->reading.utime, tag_number, origin, set);
        window_end = reading->reading.utime + window_us;
      }
      Mean& mean = window.try_emplace(beacon->second, Mean{RssiMean(averaging)}).first->second;
      mean.rssi.Add(reading->reading.rssi_dbm);
      mean.position += reading->position;
      last = reading;
    }
    if (last) CloseWindow(site, window, last->reading.utime, tag_number, origin, set);
    ++tag_number;
  }
  WeighByPlace(set.samples);
  return set;
}

CalibrationSet CalibrationSet::Keeping(
    const std::function<bool(const CalibrationSample&)>& keep) const {
  CalibrationSet kept;
  kept.epochs = epochs;
  for (const CalibrationSample& sample : samples) {
    if (keep(sample)) kept.samples.push_back(sample);
  }
  WeighByPlace(kept.samples);
  return kept;
}

}  // namespace beckon
