// The way over the floor plan, round what has been seen since.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/floor_plan.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

struct RouteOptions {
  double resolution_m = 0.05;
  // How far the floor plan and the robot's place on it may be off: walls of the plan are kept clear
  // of by this much less than the robot's radius, what the camera sees by all of it.
  double plan_tolerance_m = 0.15;
  double comfort_m = 0.30;      // free space around the disc that the route seeks
  double comfort_weight = 3.0;  // extra cost per metre where there is none of it
  double memory_s = 90.0;       // how long obstacles outside GRID are reckoned with
};
void ReadRouteOptions(ConfigTable& table, RouteOptions& options);

// Where a route may end, and what the end is worth.
struct RouteGoal {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();  // m, map frame
  double reach_m =
      1.6;  // ends up to this far from the point are accepted; nearer ones are preferred
};

struct Route {
  bool is_found = false;
  // Whether it leads through something that was seen, but from too far away to be sure of: there is
  // no other way.
  bool is_doubtful = false;
  // Whether the floor plan alone, without anything that was seen, has a way.
  bool plan_has_way = false;
  std::vector<Eigen::Vector2d> points;  // m, map frame; from the robot to the end
  double length_m = 0.0;
};

// A* backwards from all acceptable ends to the robot, on cells, for a disc; then shortened by
// straight lines that cost no more (Daniel et al. 2010, Theta*, does so within the search).
class RoutePlanner {
 public:
  RoutePlanner(const FloorPlan& plan, const RobotOptions& robot, const RouteOptions& options);

  // Takes over what GRID knows; the rest of what was seen is remembered for a while.
  void Remember(const SeenGrid& grid, const Pose2& map_from_grid, Instant now);
  // What was seen and is not in view is no longer reckoned with.
  void ForgetSeen();

  // `hidden`: where else something stands, m, map frame.
  Route Plan(const Eigen::Vector2d& base, const RouteGoal& goal, Instant now,
             const std::vector<Eigen::Vector2d>& hidden = {}) const;

  // Whether a point lies on the plan's area, and whether the plan shows it free.
  bool IsInArea(const Eigen::Vector2d& point) const { return grid_.IndexAt(point) >= 0; }
  bool IsFree(const Eigen::Vector2d& point) const;
  // Whether no wall of the plan stands between two points. A wall that the first point itself is in
  // does not count.
  bool HasLineOfSight(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;

 private:
  struct CostMap;
  // Distance of each cell to what was seen within `within_m` of the robot, m; CV_32FC1.
  cv::Mat SeenClearance(const Eigen::Vector2d& base, double within_m, Instant now,
                        const std::vector<Eigen::Vector2d>& hidden) const;
  // `firm_clearance` is kept by all means, `seen_clearance` at a high price.
  CostMap MakeCostMap(const cv::Mat& firm_clearance, const cv::Mat& seen_clearance,
                      const Eigen::Vector2d& base) const;
  Route PlanWith(const CostMap& costs, const Eigen::Vector2d& base, const RouteGoal& goal) const;
  std::vector<int> Search(const CostMap& costs, int start, const RouteGoal& goal) const;
  std::vector<Eigen::Vector2d> Shorten(const CostMap& costs, const std::vector<int>& cells) const;
  int NearestPassable(const CostMap& costs, const Eigen::Vector2d& point) const;

  RobotOptions robot_;
  RouteOptions options_;
  GridGeometry grid_;       // map frame
  cv::Mat plan_free_;       // CV_8UC1, non-zero where the plan is free
  cv::Mat plan_clearance_;  // CV_32FC1, m to the nearest cell that is not free, or the border
  std::vector<double> seen_occupied_s_;  // when the cell was last seen occupied, steady s; < 0: not
};

}  // namespace beckon
