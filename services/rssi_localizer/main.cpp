// rssi_localizer: from signal strength to where every tag may be, and with odometry and scans to
// the robot's own pose.
#include "common/channels.hpp"
#include "common/log.hpp"
#include "common/service.hpp"
#include "services/rssi_localizer/input_guard.hpp"
#include "services/rssi_localizer/messages.hpp"
#include "services/rssi_localizer/options.hpp"
#include "services/rssi_localizer/own_readings.hpp"

namespace beckon {
namespace {

void Run(Service& service, const RssiLocalizerOptions& options) {
  Localizer localizer(SiteModel::Fit(options.site, options.calibration, options.localizer),
                      options.localizer);
  RobotLocalizer robot(localizer.model(), options.robot);
  LogInfo(options.site.name + ": " + localizer.model().description);
  std::optional<OwnReadings> own_readings;
  if (!options.own_readings.empty()) {
    own_readings.emplace(options.own_readings, options.known_own_readings, options.site.window_s);
  }
  InputGuard guard;
  MessageBus& bus = service.bus();
  const auto now = [&] { return service.clock().Now(); };
  service.SetHealth(Health::kWaiting, "no RSSI yet");

  bus.Subscribe<rssi_reading_t>(channels::kRssi, [&](const rssi_reading_t& message) {
    const Reading reading = ReadingFromMessage(message);
    const Localizer::Verdict verdict = localizer.Add(reading, now());
    guard.Check(verdict, reading, now());
    robot.AddReading(reading);
    if (own_readings && verdict == Localizer::Verdict::kAccepted &&
        reading.tag == options.robot.robot_tag) {
      const auto pose = robot.At(reading.utime);
      if (pose) own_readings->Add(reading, pose->translation());
    }
  });
  bus.Subscribe<bot_core::pose_t>(channels::kOdometry, [&](const bot_core::pose_t& message) {
    const auto pose = robot.AddOdometry(now(), message.utime, OdometryFromMessage(message));
    if (pose) bus.Publish(channels::kRobotPose, RobotPoseMessage(*pose, message));
  });
  bus.Subscribe<planar_motion_t>(channels::kGroundMotion, [&](const planar_motion_t& message) {
    const auto pose =
        robot.AddGroundMotion(now(), message.utime_from, message.utime, MotionFromMessage(message));
    if (pose) bus.Publish(channels::kRobotPose, RobotPoseMessage(*pose, message));
  });
  bus.SubscribeLatest<bot_core::planar_lidar_t>(
      channels::kScan, [&](const bot_core::planar_lidar_t& message) {
        robot.AddScan(now(), message.utime, RangeScanFromMessage(message));
      });

  std::size_t next_map = 0;
  service.Every(
      std::chrono::milliseconds(std::lround(1e3 * options.update_period_s)), [&](Instant instant) {
        const std::vector<TagLocation> locations = localizer.Update(instant);
        for (const TagLocation& location : locations) {
          bus.Publish(channels::kLocation, MessageFromLocation(location));
          robot.AddLocation(location);
        }
        const auto maps =
            std::min(locations.size(), static_cast<std::size_t>(options.maps_per_update));
        for (std::size_t i = 0; i < maps; ++i) {
          const TagLocation& location = locations[next_map++ % locations.size()];
          bus.Publish(channels::kLocationMap, MapFromLocation(localizer.model().grid, location));
        }
        const std::string waiting = locations.empty() ? "no tag heard" : robot.Doubt(instant);
        if (const std::string complaint = guard.Complaint(instant); !complaint.empty()) {
          service.SetHealth(Health::kDegraded, complaint);
        } else {
          service.SetHealth(waiting.empty() ? Health::kOk : Health::kWaiting, waiting);
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
       "Locates tags from signal strength, and the robot from that, its motion and its scans.\n"
       "In: RSSI, ODOMETRY, GROUND_MOTION, SCAN. Out: LOCATION, LOCATION_MAP, ROBOT_POSE, HEALTH."},
      beckon::ReadRssiLocalizerOptions, beckon::Run);
}
