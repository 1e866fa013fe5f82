#include "services/navigator/local_frame.hpp"

#include "common/odometry_frame.hpp"

namespace beckon {
namespace {

constexpr double kOdometryTimeoutS = 0.5;
constexpr double kClockSetBackS = 1.0;
constexpr double kOverTopSpeed = 2.0;  // pushed, or driven by hand

}  // namespace

bool LocalFrame::AddOdometry(Instant now, Utime utime, const Pose2& local_from_robot) {
  const MotionLimits limits{kOverTopSpeed * robot_.max_speed_mps,
                            kOverTopSpeed * robot_.max_turn_radps};
  const bool is_same_frame =
      history_.empty() || !IsAnotherFrame(history_.newest(), utime, local_from_robot, limits);
  if (!is_same_frame) history_.Clear();
  history_.Add(utime, local_from_robot);
  odometry_at_ = now;
  return is_same_frame;
}

bool LocalFrame::AddCommand(Instant now, const Velocity& velocity) {
  bool is_same_frame = true;
  if (!history_.empty() && now.utime < history_.newest().utime - UtimeFromSeconds(kClockSetBackS)) {
    const Pose2 last = history_.newest().pose;
    history_.Clear();
    history_.Add(now.utime, last);
    is_same_frame = false;
  }
  const bool has_odometry = odometry_at_ && SecondsSince(now, *odometry_at_) < kOdometryTimeoutS;
  if (!has_odometry) {
    const double elapsed_s = commanded_at_ ? SecondsSince(now, *commanded_at_) : 0.0;
    const Pose2 last = history_.empty() ? Pose2{} : history_.newest().pose;
    // The wheels turn the robot about the disc's middle.
    const Pose2 base_motion{command_.linear_mps * elapsed_s, 0.0,
                            command_.angular_radps * elapsed_s};
    const Pose2 robot_from_base = robot_.RobotFromBase();
    history_.Add(now.utime, last * robot_from_base * base_motion * robot_from_base.Inverse());
  }
  commanded_at_ = now;
  command_ = velocity;
  return is_same_frame;
}

Pose2 LocalFrame::Now(Instant now) const {
  if (const auto pose = At(now.utime)) return *pose;
  return history_.empty() ? Pose2{} : history_.newest().pose;
}

}  // namespace beckon
