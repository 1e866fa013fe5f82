#include "tools/viewer/answer_times.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace beckon {
namespace {

// The value that this share of the values does not exceed; `values` sorted, not empty.
double Quantile(const std::vector<double>& values, double share) {
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  return values[static_cast<std::size_t>(std::max(1.0, rank)) - 1];
}

}  // namespace

void AnswerTimes::OnFrame(Utime utime) { frames_.insert(utime); }

void AnswerTimes::OnScan(Utime utime, Utime arrived) {
  const auto frame = frames_.find(utime);
  // Frames from before the watch began are not known.
  if (frame == frames_.end()) return;
  unanswered_ += static_cast<int>(std::distance(frames_.begin(), frame));
  frames_.erase(frames_.begin(), std::next(frame));
  scans_.push_back({utime, arrived});
}

void AnswerTimes::OnDrive(Utime decided, Utime arrived) {
  std::erase_if(scans_, [&](const Seen& seen) {
    if (decided < seen.arrived) return false;
    seconds_.push_back(SecondsFromUtime(arrived - seen.frame));
    return true;
  });
}

AnswerTimes::Summary AnswerTimes::Summarize() const {
  Summary summary;
  summary.answered = static_cast<int>(seconds_.size());
  summary.unanswered = unanswered_;
  if (seconds_.empty()) return summary;
  std::vector<double> sorted = seconds_;
  std::sort(sorted.begin(), sorted.end());
  summary.median_s = Quantile(sorted, 0.5);
  summary.p95_s = Quantile(sorted, 0.95);
  return summary;
}

}  // namespace beckon
