// The few metres around the robot, as GRID remembers them and the newest SCAN shows them.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "services/navigator/movers.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

// All in the local frame: the odometry frame or, where there is no odometry, one that starts with
// the program and follows the commands. It does not jump when the robot's place on the map is
// corrected.
class Surroundings {
 public:
  explicit Surroundings(const RobotOptions& robot) : robot_(robot) {}

  void SetGrid(Instant now, SeenGrid grid, const Pose2& local_from_robot);
  void SetScan(Scan scan, const Pose2& local_from_robot);
  // What GRID said does not hold any more.
  void DropGrid();
  // The local frame is a new one: nothing that was seen can be placed any more.
  void Clear();
  // Draws the map around the robot anew if anything has changed since. A GRID that is followed by
  // no other is dropped: it would go on to vouch for floor that somebody may have stepped on.
  void Update(Instant now, const Pose2& local_from_base);

  // From a point to the nearest cell that is occupied, m; large where there is none around. 0
  // outside the map.
  double Clearance(const Eigen::Vector2d& point) const;
  // Whether the floor at a point has been seen, or an obstacle just beside it, or the robot itself
  // has stood there lately. People step up to a robot that stands: floor beside it counts only if
  // it was seen since then.
  bool IsSeen(const Eigen::Vector2d& point) const;
  // Whether something stands on the straight line between two points.
  bool IsObstructed(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;
  // From the middle of the disc to the nearest obstacle of the newest scan, m; inf where there is
  // none.
  double NearestInScan(const Pose2& local_from_base) const;

  // Middles of the cells where something stands that GRID cannot know: too near for the camera.
  std::vector<Eigen::Vector2d> Hidden() const;

  // From a point to where somebody who moves was seen within the last seconds, m; inf where nobody
  // was.
  double NearestMover(const Eigen::Vector2d& point) const { return movers_.Nearest(now_s_, point); }

  const std::optional<SeenGrid>& grid() const { return grid_; }
  const Pose2& local_from_grid() const { return local_from_grid_; }

 private:
  void MoveWindow(const Eigen::Vector2d& middle);
  void DrawGrid();
  // Somebody may have stepped up to it, out of its view.
  void DoubtFloorBesideStandingRobot(const Pose2& local_from_base);
  // Takes over what the newest scan shows.
  void AddScan();
  // Where the newest scan shows something, and an earlier one of the last second floor.
  std::vector<Eigen::Vector2d> Suspects() const;
  // Where that stands which is too near for the camera, by a ray that sees no floor at all.
  // `to_known`: CV_32FC1, from each cell to the nearest that is known to be occupied, cells.
  Eigen::Vector2d HiddenPlace(const Eigen::Vector2d& direction, double range_m,
                              const cv::Mat& to_known) const;
  // The robot itself stands here.
  void AddStand();
  void MarkOccupied(const Eigen::Vector2d& point);
  // For OpenCV's drawing functions, in fractions of cells.
  cv::Point Pixel(const Eigen::Vector2d& point) const;

  RobotOptions robot_;
  std::optional<SeenGrid> grid_;
  Instant grid_at_;
  Pose2 local_from_grid_;
  std::optional<Scan> scan_;
  Pose2 local_from_scan_;
  bool is_changed_ = false;
  bool is_scan_new_ = false;  // not yet counted among those that show something hidden
  std::optional<Instant> began_;
  float now_s_ = 0.0F;  // steady time since then: a float has no tenths left after months
  Eigen::Vector2d base_ = Eigen::Vector2d::Zero();
  Pose2 stands_at_;
  float stands_since_s_ = 0.0F;
  std::optional<float> doubted_at_s_;  // the floor around, and from where
  Eigen::Vector2d doubted_from_ = Eigen::Vector2d::Zero();

  GridGeometry window_;  // around the robot
  Movers movers_;
  // What lasts, in steady seconds until when it holds; CV_32FC1.
  cv::Mat seen_until_;    // the floor was shown by a scan, or the robot has stood there
  cv::Mat hidden_until_;  // something stands here or just beyond, too near for the camera
  cv::Mat doubted_;       // CV_8UC1: non-zero where somebody may have stepped since it was seen
  bool is_grid_drawn_ = false;
  cv::Mat grid_seen_;  // what GRID says, as seen_ and obstacles_
  cv::Mat grid_obstacles_;
  // Drawn anew with each change.
  cv::Mat seen_;       // CV_8UC1: non-zero where the floor was seen
  cv::Mat obstacles_;  // CV_8UC1: zero where occupied
  cv::Mat clearance_;  // CV_32FC1, m
};

// What lies along the arc that a velocity leads to.
struct ArcView {
  double free_m = 0.0;  // that the disc can go before it touches something
  double seen_m = 0.0;  // that it can go before any of it reaches floor that was not seen
  std::optional<Eigen::Vector2d> unseen;  // the first such floor, local frame
  double clearance_m = 0.0;  // least distance of the disc's edge to an obstacle on the way
  // That it can go over seen floor without touching anything.
  double Passable() const { return std::min(free_m, seen_m); }
};
// Follows the arc for `length_m`. `curvature_per_m`: positive to the left; `direction` +1 ahead, -1
// back. The disc is taken `margin_m` larger, but may always move away from what it is already near
// to.
ArcView LookAlong(const Surroundings& surroundings, const RobotOptions& robot,
                  const Pose2& local_from_base, double curvature_per_m, int direction,
                  double length_m, double margin_m);

}  // namespace beckon
