// A random furnished flat: rooms with doors, furniture, things that lie on the floor, people who
// walk, beacons on the walls, a robot and somebody who calls it from another room.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/frames.hpp"
#include "common/grid.hpp"
#include "common/site.hpp"
#include "tools/simulation/solids.hpp"

namespace beckon::simulation {

inline constexpr char kCallerTag[] = "caller";
inline constexpr char kRobotTag[] = "robot";
inline constexpr double kWallHeightM = 2.6;
inline constexpr double kPersonRadiusM = 0.22;
inline constexpr double kPersonHeightM = 1.72;
inline constexpr double kTagHeightM = 1.0;

struct WorldOptions {
  int min_rooms = 2;
  int max_rooms = 5;
  int min_furniture = 3;
  int max_furniture = 10;
  int walking_people = 1;
  bool caller_has_body = true;  // the caller stands where the tag is, and can be bumped into
  double robot_radius_m = 0.25;
  double robot_centre_x_m = -0.15;  // of the footprint's centre in the robot frame
  double margin_m = 0.10;           // free on each side of the robot all along a way to the caller
};

struct Room {
  Eigen::Vector2d min;  // faces of its walls, m, map frame
  Eigen::Vector2d max;
  bool Contains(const Eigen::Vector2d& point) const {
    return (point.array() >= min.array()).all() && (point.array() <= max.array()).all();
  }
};

struct Door {
  Eigen::Vector2d centre;  // m, map frame
  double width_m;
};

// Lies flat on the floor and can be driven over.
struct Decal {
  enum class Kind { kRug, kPaper };
  Kind kind = Kind::kRug;
  Pose2 map_from_decal;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();  // m
};

// Walks from the first waypoint to the last and back again, in straight lines.
struct WalkingPerson {
  std::vector<Eigen::Vector2d> waypoints;  // m, map frame
  double speed_mps = 0.6;
};

struct World {
  std::uint64_t seed = 0;
  Eigen::Vector2d min = Eigen::Vector2d::Zero();  // inner faces of the outer walls, m, map frame
  Eigen::Vector2d max = Eigen::Vector2d::Zero();
  std::vector<Room> rooms;
  std::vector<Door> doors;
  std::vector<Wall> inner_walls;  // middle lines, doors left out
  double inner_wall_thickness_m = 0.1;
  std::vector<Solid> solids;  // all that stands: walls, furniture, the caller
  std::vector<Decal> decals;
  std::vector<WalkingPerson> people;
  std::vector<Beacon> beacons;
  Pose2 map_from_robot;  // at the start
  Eigen::Vector2d caller = Eigen::Vector2d::Zero();
};

// The same world for the same seed and options.
World MakeWorld(std::uint64_t seed, const WorldOptions& options);

// Distance from each cell's centre to the nearest solid, m; 0 inside. CV_32FC1, height x width.
struct ClearanceMap {
  GridGeometry grid;
  cv::Mat distance_m;
  double At(const Eigen::Vector2d& point) const;
  // Whether a disc of this radius can move along the straight line.
  bool LineIsFree(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double radius_m) const;
};
ClearanceMap MakeClearanceMap(const World& world);

// What the site file may know of the world: walls and beacons, but not the furniture.
Site SiteOf(const World& world);

}  // namespace beckon::simulation
