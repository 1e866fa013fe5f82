// What the navigator works on, free of LCM.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "common/clock.hpp"
#include "common/frames.hpp"
#include "common/grid.hpp"
#include "common/robot_file.hpp"

namespace beckon {

struct Velocity {
  double linear_mps = 0.0;     // forward positive
  double angular_radps = 0.0;  // counter-clockwise positive
};

// A virtual laser scan; ray i at bearing first + i * step in the robot frame.
struct Scan {
  Utime utime = 0;
  double first_bearing_rad = 0.0;
  double bearing_step_rad = 0.0;
  std::vector<float> ranges_m;       // inf: nothing within the visible ground; NaN: undetermined
  std::vector<float> ground_seen_m;  // how far ground was seen without a break

  double Bearing(std::size_t ray) const {
    return first_bearing_rad + static_cast<double>(ray) * bearing_step_rad;
  }
};

// What has been seen lately around the robot, in a frame that stands still on the floor.
struct SeenGrid {
  static constexpr std::uint8_t kUnknown = 255;
  static constexpr std::uint8_t kOccupiedFrom =
      140;  // 70 %: one phantom on seen floor stays below it
  Utime utime = 0;
  Pose2 grid_from_robot;                // at utime
  GridGeometry grid;                    // origin (0, 0)
  std::vector<std::uint8_t> occupancy;  // 0 = free ... 200 = occupied, or kUnknown
};

struct LocatedTag {
  Utime utime = 0;
  std::string tag;
  bool is_located = false;                               // the numbers below hold
  Eigen::Vector2d position = Eigen::Vector2d::Zero();    // m, map frame
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  // m^2
  double area_90_m2 = 0.0;
};

// Where a tag may be, as a picture.
struct PossibleArea {
  Utime utime = 0;
  std::string tag;
  GridGeometry grid;  // map frame
  // How much of the probability lies in cells at least as likely, 0 ... 254 = 99.6 %; 255: not
  // walkable.
  std::vector<std::uint8_t> credible_level;
};

struct Call {
  enum class Kind { kTag, kPoint, kCancel };
  Kind kind = Kind::kCancel;
  Utime utime = 0;
  std::string tag;
  Eigen::Vector2d point = Eigen::Vector2d::Zero();  // m, map frame
};

enum class NavigatorState { kIdle, kDriving, kStopped, kArrived, kGaveUp };

struct NavigatorStatus {
  NavigatorState state = NavigatorState::kIdle;
  std::string stop_reason;  // of the list in README.md
  std::string detail;
  std::string tag;
  bool has_goal = false;
  Eigen::Vector2d goal = Eigen::Vector2d::Zero();  // m, map frame
  double distance_to_go_m = 0.0;
  double nearest_obstacle_m = std::numeric_limits<double>::infinity();  // from the disc's centre
  std::vector<Eigen::Vector2d> route;                                   // m, map frame
};

}  // namespace beckon
