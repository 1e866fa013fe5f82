#include "services/navigator/options.hpp"

namespace beckon {

RobotOptions ReadRobotOptions(ConfigFile& file) {
  RobotOptions robot;
  ConfigTable& table = file.Table("robot");
  table.Optional("radius_m", robot.radius_m, Range{0.05, 2.0});
  table.Optional("centre_x_m", robot.centre_x_m, Range{-2.0, 2.0});
  table.Optional("max_speed_mps", robot.max_speed_mps, Range{0.05, 3.0});
  table.Optional("max_turn_radps", robot.max_turn_radps, Range{0.05, 10.0});
  table.Optional("max_acceleration_mps2", robot.max_acceleration_mps2, Range{0.05, 10.0});
  table.Optional("max_turn_acceleration_radps2", robot.max_turn_acceleration_radps2,
                 Range{0.05, 50.0});
  return robot;
}

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
  ReadArrivalOptions(table, options.navigator.arrival);
  table.Optional("give_up_after_s", options.navigator.give_up_after_s, Range{1.0, 3600.0});
  table.OptionalPath("resume_file", options.resume_file);
  table.Optional("resume_within_s", options.resume_within_s, Range{1.0, 600.0});
  return options;
}

}  // namespace beckon
