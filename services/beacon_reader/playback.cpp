#include "services/beacon_reader/playback.hpp"

#include <algorithm>

namespace beckon {

Playback::Playback(std::vector<Reading> readings, const PlaybackOptions& options)
    : readings_(std::move(readings)), options_(options) {
  std::stable_sort(readings_.begin(), readings_.end(),
                   [](const Reading& a, const Reading& b) { return a.utime < b.utime; });
}

std::vector<Reading> Playback::Due(const Instant& now) {
  constexpr double kPauseS = 1.0;
  std::vector<Reading> due;
  if (readings_.empty()) return due;
  if (!start_) start_ = now.steady;
  const auto offset = [&](std::size_t i) {
    const double recorded_s = SecondsFromUtime(readings_[i].utime - readings_.front().utime);
    return std::chrono::microseconds(UtimeFromSeconds(recorded_s / options_.speed));
  };
  while (next_ < readings_.size() && *start_ + offset(next_) <= now.steady) {
    Reading reading = readings_[next_];
    // By when it was due and not by when we came to it, so that intervals stay as recorded.
    if (options_.restamp) {
      reading.utime = now.utime - (now.steady - *start_ - offset(next_)).count();
    }
    due.push_back(std::move(reading));
    ++next_;
  }
  if (next_ == readings_.size() && options_.loop) {
    const auto again = *start_ + offset(next_ - 1) +
                       std::chrono::microseconds(UtimeFromSeconds(kPauseS / options_.speed));
    if (now.steady >= again) {
      start_ = now.steady;
      next_ = 0;
    }
  }
  return due;
}

}  // namespace beckon
