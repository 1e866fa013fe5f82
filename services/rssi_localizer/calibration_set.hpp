// Calibration readings in the form in which the localizer hears them: per tag and evaluation window
// one value for each beacon.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <utility>
#include <vector>

#include "common/site.hpp"

namespace beckon {

// Radio waves do not get stronger without bound towards the antenna, and positions are not exact.
inline constexpr double kMinDistanceM = 0.3;
// Length of the line from the beacon to a tag at the site's tag height above `position`, m.
double BeaconDistance(const Beacon& beacon, double tag_height_m, const Eigen::Vector2d& position);

// How several readings of one beacon in one window become one. Fading that is Rayleigh or near it
// is evened out best by the mean power (as the maximum-likelihood estimate), fading that is normal
// in dB by the mean in dB.
enum class Averaging { kPower, kDecibels };

class RssiMean {
 public:
  explicit RssiMean(Averaging averaging) : averaging_(averaging) {}
  void Add(double rssi_dbm);
  double rssi_dbm() const;  // of at least one
  int count() const { return count_; }

 private:
  Averaging averaging_;
  double sum_ = 0.0;  // dBm or mW
  int count_ = 0;
};

// What one tag heard in one window: (index of the beacon in the site, mean RSSI in dBm), one per
// beacon.
using Heard = std::vector<std::pair<int, double>>;

// Who says where a calibration reading was taken.
enum class Origin {
  kSurvey,   // somebody who measured it
  kBeacons,  // its place is known: one beacon heard another
  kRobot,    // the robot, by its own pose
};

struct CalibrationSample {
  int beacon = 0;  // index in the site
  double rssi_dbm = 0.0;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  // m, map frame
  double distance_m = 0.0;
  // Readings taken again and again at one place say less than their number: samples in one square
  // metre of one beacon count together at most kMaxWeightPerPlace.
  double weight = 1.0;
  int readings = 1;  // of which this is the mean
  int epoch = 0;     // index in CalibrationSet::epochs
  Origin origin = Origin::kSurvey;
};

struct CalibrationEpoch {
  Utime utime = 0;
  int tag = 0;                                         // running number
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  // mean over its readings, m, map frame
  Heard heard;
  Origin origin = Origin::kSurvey;
};

struct CalibrationSet {
  static constexpr double kMaxWeightPerPlace = 4.0;

  std::vector<CalibrationSample> samples;
  std::vector<CalibrationEpoch> epochs;

  // Implausible RSSI values are left out.
  static CalibrationSet Build(const Site& site, const std::vector<CalibrationReading>& readings,
                              Averaging averaging);

  // The samples for which `keep` is true; epochs stay as they are.
  CalibrationSet Keeping(const std::function<bool(const CalibrationSample&)>& keep) const;
};

}  // namespace beckon
