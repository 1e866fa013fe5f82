// range_caster: from ground labels to a virtual laser scan and a map of the robot's surroundings.
#include <optional>
#include <stdexcept>

#include "beckon/planar_motion_t.hpp"
#include "common/channels.hpp"
#include "common/pose_message.hpp"
#include "common/service.hpp"
#include "services/range_caster/messages.hpp"
#include "services/range_caster/options.hpp"

namespace beckon {
namespace {

void Run(Service& service, const RangeCasterOptions& options) {
  const RayCaster caster(options.camera, options.rays);
  GridMapper mapper(caster, options.map);
  MessageBus& bus = service.bus();
  std::optional<Instant> answered;

  bus.Subscribe<ground_t>(channels::kGround, [&](const ground_t& ground) {
    VirtualScan scan = caster.Cast(LabelsFromMessage(ground), ground.pitch_rad, ground.roll_rad);
    bus.Publish(channels::kScan, MessageFromScan(ground.utime, scan));
    mapper.AddScan(ground.utime, std::move(scan));
    answered = service.clock().Now();
  });
  bus.Subscribe<planar_motion_t>(channels::kGroundMotion, [&](const planar_motion_t& motion) {
    std::optional<Pose2> pose;
    if (motion.status == planar_motion_t::OK) {
      pose = Pose2{motion.translation[0], motion.translation[1], motion.rotation_rad};
      if (!pose->IsFinite()) {
        throw std::invalid_argument("the motion is not finite");
      }
    }
    mapper.motion().AddGroundMotion(motion.utime_from, motion.utime, pose);
  });
  bus.Subscribe<bot_core::pose_t>(channels::kOdometry, [&](const bot_core::pose_t& pose) {
    if (!IsPlausible(pose)) throw std::invalid_argument("the pose is not finite or not a rotation");
    mapper.motion().AddOdometry(pose.utime, PoseFromMessage(pose));
  });

  Utime published = 0;
  const auto period = std::chrono::milliseconds(std::lround(1e3 * options.grid_period_s));
  service.Every(period, [&](Instant now) {
    const bool is_fed = answered && now.steady - answered->steady < std::chrono::seconds(1);
    service.SetHealth(is_fed ? Health::kOk : Health::kWaiting, is_fed ? "" : "no GROUND for 1 s");
    mapper.Update();
    if (mapper.utime() == published) return;
    published = mapper.utime();
    bus.Publish(channels::kGrid, MessageFromMap(published, mapper.map()));
  });
  service.Run();
}

}  // namespace
}  // namespace beckon

int main(int argc, char** argv) {
  return beckon::RunService(
      argc, argv,
      {"range_caster",
       "Turns ground labels into a virtual laser scan and a rolling occupancy grid.\n"
       "In: GROUND, GROUND_MOTION, ODOMETRY. Out: SCAN, GRID, HEALTH."},
      beckon::ReadRangeCasterOptions, beckon::Run);
}
