// Names of stops, as they appear in NAVIGATOR; README.md explains each.
#pragma once

namespace beckon::stop_reason {

inline constexpr char kNone[] = "";
inline constexpr char kScanMissing[] = "scan_missing";
inline constexpr char kScanStale[] = "scan_stale";
inline constexpr char kScanInvalid[] = "scan_invalid";
inline constexpr char kScanFrozen[] = "scan_frozen";
inline constexpr char kOdometryStale[] = "odometry_stale";
inline constexpr char kOdometryInvalid[] = "odometry_invalid";
inline constexpr char kOdometryFrozen[] = "odometry_frozen";
inline constexpr char kPoseMissing[] = "pose_missing";
inline constexpr char kPoseStale[] = "pose_stale";
inline constexpr char kPoseInvalid[] = "pose_invalid";
inline constexpr char kPoseJump[] = "pose_jump";
inline constexpr char kCommandInvalid[] = "command_invalid";
inline constexpr char kObstacle[] = "obstacle";
inline constexpr char kGroundNotSeen[] = "ground_not_seen";
inline constexpr char kLocationMissing[] = "location_missing";
inline constexpr char kLocationStale[] = "location_stale";
inline constexpr char kNoRoute[] = "no_route";

}  // namespace beckon::stop_reason
