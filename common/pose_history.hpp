// Where something was a moment ago: poses by time, so that measurements that arrive late can be
// placed.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>

#include "common/clock.hpp"
#include "common/frames.hpp"

namespace beckon {

class PoseHistory {
 public:
  struct Entry {
    Utime utime;
    Pose2 pose;
  };

  explicit PoseHistory(double length_s = 3.0) : length_(UtimeFromSeconds(length_s)) {}

  // Poses have to come in order of time; one that is not newer than the last is left out.
  void Add(Utime utime, const Pose2& pose) {
    if (!entries_.empty() && utime <= entries_.back().utime) return;
    entries_.push_back({utime, pose});
    while (entries_.front().utime < utime - length_) entries_.pop_front();
  }
  void Clear() { entries_.clear(); }

  bool empty() const { return entries_.empty(); }
  const Entry& newest() const { return entries_.back(); }

  // Interpolated pose at a time; nothing before the oldest. Up to `extrapolation_s` after the
  // newest the last velocity is taken to hold on; nothing after that.
  std::optional<Pose2> At(Utime utime, double extrapolation_s = 0.0) const {
    if (entries_.empty() || utime < entries_.front().utime) return std::nullopt;
    if (utime > entries_.back().utime + UtimeFromSeconds(extrapolation_s)) return std::nullopt;
    if (entries_.size() == 1) return entries_.front().pose;
    auto after = std::lower_bound(entries_.begin(), entries_.end(), utime,
                                  [](const Entry& entry, Utime t) { return entry.utime < t; });
    if (after == entries_.begin()) return after->pose;
    const bool extrapolates = after == entries_.end();
    if (extrapolates) --after;
    auto before = std::prev(after);
    // Two poses that arrived almost together make any velocity.
    constexpr Utime kLeastBaseUs = 20'000;
    while (extrapolates && before != entries_.begin() &&
           after->utime - before->utime < kLeastBaseUs) {
      --before;
    }
    if (extrapolates && after->utime - before->utime < kLeastBaseUs) return after->pose;
    const double part = static_cast<double>(utime - before->utime) /
                        static_cast<double>(after->utime - before->utime);
    const double turn = WrapAngle(after->pose.theta - before->pose.theta);
    return Pose2{before->pose.x + part * (after->pose.x - before->pose.x),
                 before->pose.y + part * (after->pose.y - before->pose.y),
                 WrapAngle(before->pose.theta + part * turn)};
  }

 private:
  Utime length_;
  std::deque<Entry> entries_;
};

}  // namespace beckon
