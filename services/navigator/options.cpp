#include "services/navigator/options.hpp"

namespace beckon {

NavigatorServiceOptions ReadNavigatorServiceOptions(ConfigFile& file) {
  NavigatorServiceOptions options;
  std::filesystem::path site;
  file.Table("site").RequiredPath("folder", site);
  options.plan = Site::Load(site).plan;
  options.navigator.robot = ReadRobotOptions(file);

  ConfigTable& table = file.Table("navigator");
  ReadSafetyOptions(table, options.navigator.safety);
  ReadRouteOptions(table, options.navigator.route);
  ReadFollowerOptions(table, options.navigator.follower);
  FollowerOptions& follower = options.navigator.follower;
  const SafetyOptions& safety = options.navigator.safety;
  if (follower.margin_m < safety.margin_m) {
    table.Fail("follow_margin_m",
               "has to be at least safety_margin_m, or the safety monitor stops every way that the "
               "robot picks beside things");
  }
  follower.reaction_s = safety.reaction_s + FollowerOptions::kSpareS;
  ReadArrivalOptions(table, options.navigator.arrival);
  table.Optional("give_up_after_s", options.navigator.give_up_after_s, Range{1.0, 3600.0});
  table.Optional("find_itself_after_s", options.navigator.find_itself_after_s, Range{0.0, 3600.0});
  table.OptionalPath("resume_file", options.resume_file);
  table.Optional("resume_within_s", options.resume_within_s, Range{1.0, 600.0});
  return options;
}

}  // namespace beckon
