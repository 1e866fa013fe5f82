// A recorded site folder, played as if it were heard now. Pure: time is passed in.
#pragma once

#include <optional>
#include <vector>

#include "common/clock.hpp"
#include "common/site.hpp"

namespace beckon {

struct PlaybackOptions {
  double speed = 1.0;   // recorded seconds a second
  bool loop = false;    // from the start again, one second after the end
  bool restamp = true;  // dates readings to when they are played; false: keeps the recorded dates
};

class Playback {
 public:
  // Plays in the order of time, whatever the order of the rows.
  Playback(std::vector<Reading> readings, const PlaybackOptions& options);

  // What is due since the last call; the first call starts the tape.
  std::vector<Reading> Due(const Instant& now);
  bool ended() const { return !options_.loop && next_ == readings_.size(); }

 private:
  std::vector<Reading> readings_;
  PlaybackOptions options_;
  std::size_t next_ = 0;
  std::optional<std::chrono::microseconds> start_;  // steady, when the first reading was due
};

}  // namespace beckon
