// What to do with readings that the localizer does not take: each is counted, and each cause is
// told to a person once.
#pragma once

#include <set>
#include <string>

#include "services/rssi_localizer/localizer.hpp"

namespace beckon {

class InputGuard {
 public:
  // Returns for an accepted reading; throws std::invalid_argument, with the reason, for one that
  // makes no sense. Undeclared beacons are logged once each, up to a hundred names.
  void Check(Localizer::Verdict verdict, const Reading& reading);

  // One sentence for HEALTH; empty where nothing is wrong with the configuration of the site.
  std::string Complaint() const;

 private:
  std::set<std::string> undeclared_;
};

}  // namespace beckon
