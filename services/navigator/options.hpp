// What navigator takes from the robot's configuration.
#pragma once

#include <filesystem>

#include "common/site.hpp"
#include "services/navigator/navigator.hpp"

namespace beckon {

struct NavigatorServiceOptions {
  NavigatorOptions navigator;
  FloorPlan plan;  // of [site] folder
  // Where the call is kept while it is being answered, so that a restarted navigator goes on with
  // it; empty: it is not kept.
  std::filesystem::path resume_file;
  double resume_within_s = 10.0;  // an older call is not taken up again
};
NavigatorServiceOptions ReadNavigatorServiceOptions(ConfigFile& file);

}  // namespace beckon
