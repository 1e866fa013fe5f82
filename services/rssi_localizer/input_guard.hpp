// What to do with readings that the localizer does not take: each is counted, and each cause is
// told to a person once.
#pragma once

#include <map>
#include <string>

#include "common/clock.hpp"

#include "services/rssi_localizer/localizer.hpp"

namespace beckon {

class InputGuard {
 public:
  // Returns for an accepted reading; throws std::invalid_argument, with the reason, for one that
  // makes no sense. Undeclared beacons are logged once each, up to a hundred names.
  void Check(Localizer::Verdict verdict, const Reading& reading, const Instant& now);

  // One sentence for HEALTH; empty where no undeclared beacon was heard in the last minute.
  std::string Complaint(const Instant& now) const;

 private:
  std::map<std::string, std::chrono::microseconds> undeclared_;  // when last heard, steady clock
};

}  // namespace beckon
