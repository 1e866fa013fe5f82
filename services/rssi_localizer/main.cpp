// rssi_localizer: from signal strength to where every tag may be, and from odometry to the robot's
// pose.
#include "common/channels.hpp"
#include "common/log.hpp"
#include "common/service.hpp"
#include "services/rssi_localizer/input_guard.hpp"
#include "services/rssi_localizer/messages.hpp"
#include "services/rssi_localizer/options.hpp"

namespace beckon {
namespace {

void Run(Service& service, const RssiLocalizerOptions& options) {
  Localizer localizer(SiteModel::Fit(options.site, options.calibration, options.localizer),
                      options.localizer);
  LogInfo(options.site.name + ": " + localizer.model().description);
  InputGuard guard;
  MessageBus& bus = service.bus();
  service.SetHealth(Health::kWaiting, "no RSSI yet");

  bus.Subscribe<rssi_reading_t>(channels::kRssi, [&](const rssi_reading_t& message) {
    const Reading reading = ReadingFromMessage(message);
    guard.Check(localizer.Add(reading, service.clock().Now()), reading);
  });
  bus.Subscribe<bot_core::pose_t>(channels::kOdometry, [&](const bot_core::pose_t& odometry) {
    bus.Publish(channels::kRobotPose, RobotPoseFromOdometry(odometry, options.map_from_odometry));
  });

  std::size_t next_map = 0;
  service.Every(
      std::chrono::milliseconds(std::lround(1e3 * options.update_period_s)), [&](Instant now) {
        const std::vector<TagLocation> locations = localizer.Update(now);
        for (const TagLocation& location : locations) {
          bus.Publish(channels::kLocation, MessageFromLocation(location));
        }
        const auto maps =
            std::min(locations.size(), static_cast<std::size_t>(options.maps_per_update));
        for (std::size_t i = 0; i < maps; ++i) {
          const TagLocation& location = locations[next_map++ % locations.size()];
          bus.Publish(channels::kLocationMap, MapFromLocation(localizer.model().grid, location));
        }
        if (!guard.Complaint().empty()) {
          service.SetHealth(Health::kDegraded, guard.Complaint());
        } else if (locations.empty()) {
          service.SetHealth(Health::kWaiting, "no tag heard");
        } else {
          service.SetHealth(Health::kOk);
        }
      });
  service.Run();
}

}  // namespace
}  // namespace beckon

int main(int argc, char** argv) {
  return beckon::RunService(
      argc, argv,
      {"rssi_localizer",
       "Locates tags from signal strength, and the robot from odometry.\n"
       "In: RSSI, ODOMETRY. Out: LOCATION, LOCATION_MAP, ROBOT_POSE, HEALTH."},
      beckon::ReadRssiLocalizerOptions, beckon::Run);
}
