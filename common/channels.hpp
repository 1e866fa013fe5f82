// Names of the LCM channels, and only here. What each carries and who sends it: lcmtypes/ and the
// data-flow table in README.md.
#pragma once

namespace beckon::channels {

inline constexpr char kRssi[] = "RSSI";
inline constexpr char kLocation[] = "LOCATION";
inline constexpr char kLocationMap[] = "LOCATION_MAP";
inline constexpr char kRobotPose[] = "ROBOT_POSE";
inline constexpr char kCamera[] = "CAMERA";
inline constexpr char kGround[] = "GROUND";
inline constexpr char kGroundMotion[] = "GROUND_MOTION";
inline constexpr char kScan[] = "SCAN";
inline constexpr char kGrid[] = "GRID";
inline constexpr char kOdometry[] = "ODOMETRY";
inline constexpr char kCall[] = "CALL";
inline constexpr char kDrive[] = "DRIVE";
inline constexpr char kNavigator[] = "NAVIGATOR";
inline constexpr char kHealth[] = "HEALTH";

}  // namespace beckon::channels
