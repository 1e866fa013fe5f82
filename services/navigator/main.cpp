// navigator: comes when called.
#include <chrono>
#include <stdexcept>

#include "common/channels.hpp"
#include "common/pose_message.hpp"
#include "common/service.hpp"
#include "services/navigator/messages.hpp"
#include "services/navigator/options.hpp"
#include "services/navigator/resume_file.hpp"

namespace beckon {
namespace {

void Run(Service& service, const NavigatorServiceOptions& options) {
  Navigator navigator(options.navigator, options.plan);
  ResumeFile resume(options.resume_file, options.resume_within_s);
  MessageBus& bus = service.bus();
  const auto now = [&] { return service.clock().Now(); };
  if (const auto call = resume.Load(now().utime)) navigator.Resume(now(), *call);

  bus.Subscribe<call_t>(channels::kCall, [&](const call_t& message) {
    navigator.OnCall(now(), CallFromMessage(message));
    resume.Save(now().utime, navigator.ActiveCall());
  });
  bus.Subscribe<location_t>(channels::kLocation, [&](const location_t& message) {
    navigator.OnLocation(now(), LocationFromMessage(message));
  });
  bus.Subscribe<probability_map_t>(channels::kLocationMap, [&](const probability_map_t& message) {
    navigator.OnPossibleArea(now(), AreaFromMessage(message));
  });
  bus.Subscribe<bot_core::pose_t>(channels::kRobotPose, [&](const bot_core::pose_t& message) {
    const Pose2 pose = CheckedPose(message, [&] { navigator.OnInvalidPose(now()); });
    navigator.OnPose(now(), message.utime, pose);
  });
  bus.Subscribe<bot_core::pose_t>(channels::kOdometry, [&](const bot_core::pose_t& message) {
    const Pose2 pose = CheckedPose(message, [&] { navigator.OnInvalidOdometry(now()); });
    navigator.OnOdometry(now(), message.utime, pose);
  });
  bus.SubscribeLatest<bot_core::planar_lidar_t>(channels::kScan,
                                                [&](const bot_core::planar_lidar_t& message) {
                                                  navigator.OnScan(now(), ScanFromMessage(message));
                                                });
  bus.SubscribeLatest<occupancy_grid_t>(channels::kGrid, [&](const occupancy_grid_t& message) {
    navigator.OnGrid(now(), GridFromMessage(message));
  });

  std::int64_t sequence = 0;
  service.Every(std::chrono::milliseconds(50), [&](Instant instant) {
    // Dated by what it was decided on, so that a turn that took long makes it old.
    const Velocity velocity = navigator.Tick(instant);
    bus.Publish(channels::kDrive, MessageFromVelocity(instant.utime, ++sequence, velocity));
  });
  service.Every(std::chrono::milliseconds(100), [&](Instant instant) {
    bus.Publish(channels::kNavigator, MessageFromStatus(instant.utime, navigator.status()));
  });
  service.Every(std::chrono::milliseconds(1000), [&](Instant instant) {
    resume.Save(instant.utime, navigator.ActiveCall());
    const NavigatorStatus& status = navigator.status();
    service.SetHealth(status.stop_reason.empty() ? Health::kOk : Health::kDegraded,
                      status.stop_reason);
  });
  service.OnStop([&] {
    bus.Publish(channels::kDrive, MessageFromVelocity(now().utime, ++sequence, {}));
    resume.Save(now().utime, std::nullopt);
  });
  service.Run();
}

}  // namespace
}  // namespace beckon

int main(int argc, char** argv) {
  return beckon::RunService(
      argc, argv,
      {"navigator",
       "Answers calls: route on the floor plan, avoidance, safety stops, 20 commands a second.\n"
       "In: CALL, LOCATION, LOCATION_MAP, ROBOT_POSE, ODOMETRY, SCAN, GRID. Out: DRIVE, NAVIGATOR, "
       "HEALTH."},
      beckon::ReadNavigatorServiceOptions, beckon::Run);
}
