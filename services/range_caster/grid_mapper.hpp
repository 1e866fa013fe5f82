// What the camera has seen around the robot lately: a rolling occupancy grid, moved by odometry or,
// where there is none, by what the ground itself says of the motion.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/clock.hpp"
#include "common/config.hpp"
#include "common/ego_motion.hpp"
#include "common/frames.hpp"
#include "common/grid.hpp"
#include "services/range_caster/ray_caster.hpp"

namespace beckon {

struct OccupancyMapOptions {
  double resolution_m = 0.05;
  int cells = 240;         // along each side; 240 x 240 bytes still fit one datagram
  double memory_s = 40.0;  // time constant with which evidence fades
};
void ReadOccupancyMapOptions(ConfigTable& table, OccupancyMapOptions& options);

// Log-odds of being occupied, cell by cell (Moravec and Elfes 1985). The grid stands still on the
// floor; when the robot comes too far from its middle, it is shifted by whole cells.
class OccupancyMap {
 public:
  explicit OccupancyMap(const OccupancyMapOptions& options);

  // The robot has moved.
  void Move(const Pose2& old_robot_from_robot);
  // Nothing that was seen can be placed any more.
  void Forget();
  // Lets evidence fade for `elapsed_s`, the time since the last scan, then adds what this one says,
  // seen from where the robot is now. Scans in quick succession say less each.
  void Integrate(const VirtualScan& scan, const RayCaster& caster, double elapsed_s);

  double resolution_m() const { return grid_.resolution_m; }
  int cells() const { return grid_.width; }
  const Pose2& grid_from_robot() const { return grid_from_robot_; }
  // As in occupancy_grid_t: 0 ... 200, 255 where nothing is known.
  std::vector<std::uint8_t> Occupancy() const;

 private:
  void Recentre();

  OccupancyMapOptions options_;
  GridGeometry grid_;  // in its own frame: origin (0, 0)
  Pose2 grid_from_robot_;
  std::vector<float> log_odds_;  // 0: nothing known
  // What this scan says of each cell it touches, so that a cell that many rays cross counts once.
  std::vector<float> evidence_;
  std::vector<int> touched_;
};

// Puts each scan into the map at the place where the robot was when its frame was taken. Motion
// that arrives after the scan is waited for, up to the scan that comes 0.3 s later; then the map
// starts anew.
class GridMapper {
 public:
  GridMapper(const RayCaster& caster, const OccupancyMapOptions& options)
      : caster_(caster), map_(options) {}

  EgoMotion& motion() { return motion_; }
  void AddScan(Utime utime, VirtualScan scan);
  // Takes in the scans whose motion is known by now; whether there were any.
  bool Update();

  const OccupancyMap& map() const { return map_; }
  Utime utime() const { return utime_; }  // of the newest scan in the map; 0: none yet

 private:
  struct Pending {
    Utime utime;
    VirtualScan scan;
  };

  const RayCaster& caster_;
  OccupancyMap map_;
  EgoMotion motion_;
  std::deque<Pending> pending_;
  Utime utime_ = 0;
};

}  // namespace beckon
