#include "services/rssi_localizer/input_guard.hpp"

#include <stdexcept>

#include "common/log.hpp"

namespace beckon {

void InputGuard::Check(Localizer::Verdict verdict, const Reading& reading) {
  constexpr std::size_t kMaxNames = 100;
  using Verdict = Localizer::Verdict;
  switch (verdict) {
    case Verdict::kAccepted:
      return;
    case Verdict::kUndeclaredBeacon:
      if (undeclared_.size() < kMaxNames && undeclared_.insert(reading.beacon).second) {
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

std::string InputGuard::Complaint() const {
  if (undeclared_.empty()) return "";
  return std::to_string(undeclared_.size()) + " beacon(s) heard that the site does not declare, " +
         "such as '" + *undeclared_.begin() + "'";
}

}  // namespace beckon
