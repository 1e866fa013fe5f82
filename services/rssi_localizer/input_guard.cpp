#include "services/rssi_localizer/input_guard.hpp"

#include <stdexcept>

#include "common/log.hpp"

namespace beckon {

void InputGuard::Check(Localizer::Verdict verdict, const Reading& reading, const Instant& now) {
  constexpr std::size_t kMaxNames = 100;
  using Verdict = Localizer::Verdict;
  switch (verdict) {
    case Verdict::kAccepted:
      return;
    case Verdict::kUndeclaredBeacon:
      if (const auto known = undeclared_.find(reading.beacon); known != undeclared_.end()) {
        known->second = now.steady;
      } else if (undeclared_.size() < kMaxNames) {
        undeclared_[reading.beacon] = now.steady;
        LogWarning("beacon '" + reading.beacon +
                   "' is not declared in the site file; its readings are not used");
      }
      throw std::invalid_argument("beacon '" + reading.beacon + "' is not declared in the site");
    case Verdict::kImplausible:
      throw std::invalid_argument("a reading without a tag, of before 1970, or of " +
                                  std::to_string(reading.rssi_dbm) + " dBm");
    case Verdict::kFuture:
      throw std::invalid_argument("a reading of the future: are the clocks synchronised?");
    case Verdict::kLate:
      throw std::invalid_argument("a reading older than the window of tag '" + reading.tag + "'");
    case Verdict::kTooManyTags:
      throw std::invalid_argument("more than max_tags tags; '" + reading.tag + "' is not located");
  }
}

std::string InputGuard::Complaint(const Instant& now) const {
  constexpr std::chrono::minutes kRemembered{1};
  int heard = 0;
  const std::string* first = nullptr;
  for (const auto& [beacon, last] : undeclared_) {
    if (now.steady - last > kRemembered) continue;
    ++heard;
    if (!first) first = &beacon;
  }
  if (!first) return "";
  return std::to_string(heard) + " beacon(s) heard that the site does not declare, such as '" +
         *first + "'";
}

}  // namespace beckon
