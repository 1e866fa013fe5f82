// The last in the chain: every command passes here before it is sent.
//
// A stop has a name, lasts as long as its cause, and ends by itself. Ages are checked twice: that
// of the measurement on the wall clock, and the time since a message arrived on the steady clock,
// so that neither a sender that repeats itself nor a wall clock that is set can keep the robot
// going.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "services/navigator/stop_reasons.hpp"
#include "services/navigator/surroundings.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

struct SafetyOptions {
  double scan_timeout_s = 0.5;
  double pose_timeout_s = 2.0;
  double margin_m = 0.03;    // kept free around the disc
  double reaction_s = 0.2;   // from a picture to wheels that brake
  double pose_jump_m = 0.7;  // corrections beyond this are jumps,
  double pose_jump_rad = 0.5;
  double pose_settle_s = 0.6;  // and the pose has to stay put as long before it is used
};
void ReadSafetyOptions(ConfigTable& table, SafetyOptions& options);

class SafetyMonitor {
 public:
  SafetyMonitor(const RobotOptions& robot, const SafetyOptions& options)
      : robot_(robot), options_(options) {}

  // A scan that makes sense, with where the robot was when it was taken.
  void OnScan(Instant now, const Scan& scan, const Pose2& local_from_robot);
  void OnInvalidScan(Instant now) { invalid_scan_ = now; }
  // A pose that makes sense; `correction` is by how much it differs from what was expected.
  void OnPose(Instant now, Utime utime, const Pose2& correction);
  void OnInvalidPose(Instant now) { invalid_pose_ = now; }
  // Odometry that makes sense. Where there has been some, it has to go on.
  void OnOdometry(Instant now, Utime utime, const Pose2& odometry_from_robot);
  // Places told before are of another frame.
  void ForgetPlaces();
  void OnInvalidOdometry(Instant now) { invalid_odometry_ = now; }

  // What keeps the robot from moving at all; empty where nothing does.
  std::string Blocker(Instant now) const;
  // Whether that is merely that no ROBOT_POSE comes.
  static bool IsWithoutPose(const std::string& blocker) {
    return blocker == stop_reason::kPoseMissing || blocker == stop_reason::kPoseStale;
  }

  struct Verdict {
    Velocity velocity;   // to be sent
    std::string reason;  // of a stop that was imposed; empty where the command passed
  };
  // `elapsed_s`: since the last call. `needs_pose`: false for a robot that looks for its place on
  // the map, and may move without one.
  Verdict Pass(Instant now, double elapsed_s, const Velocity& wanted,
               const Surroundings& surroundings, const Pose2& local_from_base,
               bool needs_pose = true);

  const Velocity& last() const { return last_; }
  // Length of the way to standstill, with the margin for delays, m.
  double StoppingDistance(double speed_mps) const;

 private:
  struct Arrival {
    Instant at;
    Utime utime;
  };
  void NoteWhatIsAhead(const Scan& scan);
  bool SeesAhead(Instant now) const;
  static bool IsOlder(Instant now, const Arrival& arrival, double limit_s);
  // Why this velocity is not safe; empty where it is.
  std::string HazardOf(Instant now, const Velocity& velocity, const Surroundings& surroundings,
                       const Pose2& local_from_base) const;
  Velocity Limited(double elapsed_s, const Velocity& wanted) const;

  RobotOptions robot_;
  SafetyOptions options_;
  std::optional<Arrival> scan_;
  // The newest scan that shows what is ahead, part by part from right to left.
  static constexpr std::size_t kAheadParts = 4;
  std::array<std::optional<Arrival>, kAheadParts> sight_;
  std::optional<Arrival> pose_;
  std::optional<Instant> invalid_scan_;
  std::optional<Instant> invalid_pose_;
  std::optional<Instant> invalid_odometry_;
  std::optional<Arrival> odometry_;
  // What was commanded since odometry last showed a motion.
  Pose2 moved_from_;
  double commanded_m_ = 0.0;
  double commanded_rad_ = 0.0;
  std::optional<Instant> odometry_frozen_;
  std::optional<Instant> jumped_;
  // The newest scan, where it was taken, and the motion since scans are the same to the last bit.
  std::optional<Scan> repeated_scan_;
  Pose2 repeated_from_;
  double repeated_m_ = 0.0;
  double repeated_rad_ = 0.0;
  bool is_frozen_ = false;
  Velocity last_;
};

}  // namespace beckon
