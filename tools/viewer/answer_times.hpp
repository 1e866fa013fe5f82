// How long it takes from a camera frame to the command that answers it.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "common/clock.hpp"

namespace beckon {

// A frame is answered by the first DRIVE that is decided after the SCAN of the frame's own utime
// has come; the time counts from the frame's capture to the command's arrival. Messages are handed
// in as they arrive.
class AnswerTimes {
 public:
  void OnFrame(Utime utime);
  void OnScan(Utime utime, Utime arrived);
  // `decided`: the command's utime.
  void OnDrive(Utime decided, Utime arrived);

  struct Summary {
    int answered = 0;
    int unanswered = 0;  // passed over for a newer frame
    double median_s = 0.0;
    double p95_s = 0.0;
  };
  Summary Summarize() const;

 private:
  struct Seen {
    Utime frame;
    Utime arrived;
  };
  std::set<Utime> frames_;   // that have no scan yet
  std::vector<Seen> scans_;  // that have no command yet
  std::vector<double> seconds_;
  int unanswered_ = 0;
};

}  // namespace beckon
