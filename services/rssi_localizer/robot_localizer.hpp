// The robot's own pose from what arrives: odometry or the motion of the ground, scans, and the
// readings of the tag that rides on the robot. Time is passed in.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.hpp"
#include "common/ego_motion.hpp"
#include "services/rssi_localizer/localizer.hpp"
#include "services/rssi_localizer/robot_pose_filter.hpp"

namespace beckon {

struct RobotLocalizerOptions {
  PoseFilterOptions filter;
  std::string robot_tag = "robot";  // the robot's own tag among those heard
  // Where the odometry frame lies on the map; nothing: the robot finds that out.
  std::optional<Pose2> map_from_odometry;
};

class RobotLocalizer {
 public:
  // The model has to outlive this.
  RobotLocalizer(const SiteModel& model, const RobotLocalizerOptions& options);

  // Poses in order of time. Each returns where the robot is on the map at `utime`; nothing while
  // that is not known.
  std::optional<Pose2> AddOdometry(Instant now, Utime utime, const Pose2& odometry_from_robot);
  // `motion`: pose at `utime` in the robot frame at `utime_from`; nothing when it could not be
  // found. Returns nothing while there is odometry.
  std::optional<Pose2> AddGroundMotion(Instant now, Utime utime_from, Utime utime,
                                       const std::optional<Pose2>& motion);
  // Throws std::invalid_argument for a scan that makes no sense.
  void AddScan(Instant now, Utime utime, const RangeScan& scan);
  // A reading that Localizer has accepted. Those of other tags are none of its business.
  void AddReading(const Reading& reading);
  // Where the robot is on the map at `utime`, within the last seconds; nothing while that is not
  // known.
  std::optional<Pose2> At(Utime utime) const;
  // Where Localizer finds the robot's tag.
  void AddLocation(const TagLocation& location);

  // One sentence on why there is no pose; empty where there is, and where nothing was ever heard
  // of a robot.
  std::string Doubt(Instant now) const;
  const RobotPoseFilter& filter() const { return filter_; }

 private:
  struct PendingScan {
    Utime utime;
    RangeScan scan;
  };
  void StartWhereTold(Utime utime, const Pose2& odometry_from_robot);
  bool UseScan();
  void Follow(Utime newest);
  bool MoveTo(Utime utime);
  void JumpTo(Utime utime);
  void UseRadio();

  const SiteModel& model_;
  RobotLocalizerOptions options_;
  RobotPoseFilter filter_;
  bool waits_for_told_start_;  // for the first pose of the odometry
  EgoMotion motion_;
  std::optional<Instant> odometry_at_;
  std::optional<Instant> ground_motion_since_;
  std::optional<Instant> motion_at_;
  std::optional<Instant> scan_at_;
  std::optional<PendingScan> scan_;      // not used yet
  std::optional<Utime> utime_;           // at which the filter's pose holds
  std::vector<BeaconReading> readings_;  // younger than a window, and not used yet
  double radio_m_ = std::numeric_limits<double>::infinity();  // driven since
};

}  // namespace beckon
