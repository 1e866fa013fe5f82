// Where every tag may be, kept up to date from a stream of readings. Time is passed in.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.hpp"
#include "common/site.hpp"
#include "services/rssi_localizer/grid_tracker.hpp"
#include "services/rssi_localizer/measurement_model.hpp"
#include "services/rssi_localizer/model_selection.hpp"
#include "services/rssi_localizer/posterior.hpp"

namespace beckon {

enum class MeasurementModelKind {
  kLogNormal,    // fitted log-normal with a robust tail and an offset for each beacon
  kMap2d,        // joint histogram of RSSI and distance as measured
  kMapFiltered,  // what held-back calibration readings choose, see model_selection.hpp
};

struct LocalizerOptions {
  FloorGridOptions grid;
  MeasurementModelKind model = MeasurementModelKind::kMapFiltered;
  PathLoss prior;        // expected before any calibration, and used as it is where there is none
  bool tracking = true;  // false: each window of readings stands alone
  MotionModel motion;
  // While a tag stays where it is, what is wrong with the readings of one beacon stays wrong. A
  // reading counts in full when the beacon's last one is this old, and in proportion before.
  double correlation_s = 1.5;
  double silent_after_s = 5.0;   // not heard for so long: SILENT; at least the site's window
  double forget_after_s = 60.0;  // not heard for so long: all that is known of the tag is dropped
  int max_tags = 2000;           // more are refused until others have been forgotten
};

// What is known about a site before a tag is heard: grid and measurement model.
struct SiteModel {
  Site site;
  FloorGrid grid;
  MeasurementModel model;
  MeasurementModel block_model;  // at the representatives of the grid's blocks
  ModelChoice choice;
  PathLoss path_loss;
  std::string description;  // of the model, for a person

  // Fits to the calibration readings; none: the prior. Throws std::invalid_argument for a floor
  // plan with no free cell.
  static SiteModel Fit(const Site& site, const std::vector<CalibrationReading>& calibration,
                       const LocalizerOptions& options);
};

// One received value of one beacon (index in the site).
struct BeaconReading {
  Utime utime = 0;
  int beacon = 0;
  double rssi_dbm = 0.0;
};

// Mean RSSI of each beacon.
Heard MeanPerBeacon(const std::vector<BeaconReading>& readings, Averaging averaging);

// The Bayes filter of one tag.
class TagTracker {
 public:
  // Both have to outlive this.
  TagTracker(const SiteModel& model, const LocalizerOptions& options);

  // Takes readings into account, in slices no longer than the site's window, and moves on to
  // `utime`. Those older than the last call are used as if they were new: they are late by a
  // network's delay.
  void Advance(std::vector<BeaconReading> readings, Utime utime);

  const SparsePosterior& posterior() const { return tracker_.posterior(); }

 private:
  void AddSlice(const std::vector<BeaconReading>& slice, Utime utime);
  void PredictTo(Utime utime);

  const SiteModel& model_;
  double correlation_s_;
  GridTracker tracker_;
  std::optional<Utime> utime_;
  std::map<int, BeaconReading> last_;  // per beacon
};

struct TagLocation {
  enum class Status { kOk, kOutside, kSilent };
  std::string tag;
  Utime utime = 0;  // of the newest reading
  Status status = Status::kOk;
  Estimate estimate;
  int beacons = 0;   // heard in the window
  int readings = 0;  // heard in the window
  SparsePosterior posterior;
};

class Localizer {
 public:
  enum class Verdict {
    kAccepted,
    kUndeclaredBeacon,  // the site does not know it
    kImplausible,       // no radio receives such a power, no tag, or before 1970
    kFuture,            // dated more than a second after now
    kLate,              // older than the window that ends with the tag's newest reading
    kTooManyTags,
  };

  Localizer(SiteModel model, const LocalizerOptions& options);
  // Tags hold on to the model.
  Localizer(const Localizer&) = delete;
  Localizer& operator=(const Localizer&) = delete;

  Verdict Add(const Reading& reading, const Instant& now);

  // Locates every tag that has been heard within forget_after_s, and forgets the others. A tag's
  // own time runs from its newest reading on the steady clock, so that recorded readings with old
  // dates work too.
  std::vector<TagLocation> Update(const Instant& now);

  const SiteModel& model() const { return model_; }
  std::size_t tags() const { return tags_.size(); }

 private:
  struct Tag {
    std::vector<BeaconReading> window;   // all that is younger than the site's window
    std::vector<BeaconReading> pending;  // not yet seen by the tracker
    Utime newest = 0;
    std::chrono::microseconds newest_arrival{};
    std::optional<TagTracker> tracker;
    TagLocation location;          // as of the last reading
    std::optional<Utime> located;  // in the tag's own time
  };

  void Locate(const std::string& name, Tag& tag, Utime utime);
  bool IsExplained(const Heard& heard, const SparsePosterior& posterior) const;

  SiteModel model_;
  LocalizerOptions options_;
  std::map<std::string, int> beacon_index_;
  std::map<std::string, Tag> tags_;
};

}  // namespace beckon
