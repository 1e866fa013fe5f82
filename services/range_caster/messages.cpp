#include "services/range_caster/messages.hpp"

#include "common/label_runs.hpp"

namespace beckon {

cv::Mat LabelsFromMessage(const ground_t& message) {
  return DecodeLabels(message.runs, message.width, message.height);
}

bot_core::planar_lidar_t MessageFromScan(Utime utime, const VirtualScan& scan) {
  bot_core::planar_lidar_t message{};
  message.utime = utime;
  message.ranges = scan.ranges_m;
  message.nranges = static_cast<std::int32_t>(scan.ranges_m.size());
  message.intensities = scan.ground_seen_m;
  message.nintensities = static_cast<std::int32_t>(scan.ground_seen_m.size());
  message.rad0 = static_cast<float>(scan.first_bearing_rad);
  message.radstep = static_cast<float>(scan.bearing_step_rad);
  return message;
}

occupancy_grid_t MessageFromMap(Utime utime, const OccupancyMap& map) {
  occupancy_grid_t message{};
  message.utime = utime;
  message.grid_from_robot[0] = map.grid_from_robot().x;
  message.grid_from_robot[1] = map.grid_from_robot().y;
  message.grid_from_robot[2] = map.grid_from_robot().theta;
  message.resolution_m = map.resolution_m();
  message.width = message.height = map.cells();
  message.occupancy = map.Occupancy();
  message.size = static_cast<std::int32_t>(message.occupancy.size());
  return message;
}

}  // namespace beckon
