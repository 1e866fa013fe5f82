// base_adapter: a robot base on a serial line, by the protocol of line_protocol.hpp.
#include "beckon/velocity_command_t.hpp"
#include "common/channels.hpp"
#include "common/pose_message.hpp"
#include "common/service.hpp"
#include "tools/base_adapter/adapter.hpp"
#include "tools/base_adapter/device_link.hpp"

namespace beckon {
namespace {

void Run(Service& service, const BaseAdapterOptions& options) {
  constexpr double kSilentS = 1.0;
  CommandKeeper commands(options);
  OdometryKeeper odometry(options.robot);
  OdometryReader reader;
  DeviceLink link(options.device, options.baud);
  link.on_opened = [&] { reader.Restart(); };
  link.on_lost = [&](const std::string& why) { service.SetHealth(Health::kFailed, why); };
  std::optional<Instant> heard;
  const auto now = [&] { return service.clock().Now(); };
  const auto send = [&] {
    const Drive drive = commands.At(now());
    const std::string line = VelocityLine(drive.linear_mps, drive.angular_radps);
    link.With(now(), [&](ByteStream& device) {
      device.Write({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
    });
  };

  service.bus().Subscribe<velocity_command_t>(
      channels::kDrive, [&](const velocity_command_t& message) {
        commands.Set(now(), message.utime, {message.linear_mps, message.angular_radps});
        send();
      });
  // Also when nobody commands: the base then hears that it shall stand.
  service.Every(std::chrono::milliseconds(50), [&](Instant) { send(); });
  service.Every(std::chrono::milliseconds(5), [&](Instant) {
    link.With(now(), [&](ByteStream& device) {
      const OdometryReader::Counts before = reader.counts();
      // Lines that came in one piece have no time between them: the newest stands for all.
      const std::vector<Pose2> poses = reader.Push(device.Read(std::chrono::milliseconds(0)));
      if (!poses.empty()) {
        heard = now();
        const auto report = odometry.Add(*heard, poses.back());
        service.bus().Publish(channels::kOdometry,
                              MessageFromPose(heard->utime, report.odometry_from_robot,
                                              report.forward_mps, report.turn_radps));
      }
      const OdometryReader::Counts& after = reader.counts();
      service.CountInput(after.accepted - before.accepted, after.refused - before.refused, 0);
      const bool is_heard = heard && SecondsSince(now(), *heard) < kSilentS;
      service.SetHealth(is_heard ? Health::kOk : Health::kDegraded,
                        is_heard ? "" : "no odometry from " + options.device);
    });
  });
  service.OnStop([&] {
    commands.Set(now(), now().utime, {});
    send();
  });
  service.Run();
}

}  // namespace
}  // namespace beckon

int main(int argc, char** argv) {
  return beckon::RunService(argc, argv,
                            {"base_adapter",
                             "Connects a robot base on a serial line: V lines out, O lines in.\n"
                             "In: DRIVE, a device. Out: ODOMETRY, HEALTH, the device."},
                            beckon::ReadBaseAdapterOptions, beckon::Run);
}
