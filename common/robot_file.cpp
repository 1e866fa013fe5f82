#include "common/robot_file.hpp"

#include <cstdlib>

#include "common/message_bus.hpp"

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

std::string ReadLcmUrl(ConfigFile& file) {
  const char* from_environment = std::getenv("LCM_DEFAULT_URL");
  std::string url =
      from_environment != nullptr && *from_environment != '\0' ? from_environment : kDefaultLcmUrl;
  file.Table("lcm").Optional("url", url);
  return url;
}

}  // namespace beckon
