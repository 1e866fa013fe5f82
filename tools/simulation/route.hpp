// Shortest ways through a world whose furniture is known: to script a drive and to judge one.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tools/simulation/world.hpp"

namespace beckon::simulation {

// The shortest way for a disc of this radius to within `reach_m` of the goal, as points from start
// to end; empty where there is none. Dijkstra on the clearance map's cells, then shortened by
// straight lines.
std::vector<Eigen::Vector2d> ShortestWay(const ClearanceMap& map, const Eigen::Vector2d& start,
                                         const Eigen::Vector2d& goal, double reach_m,
                                         double radius_m);

double LengthOf(const std::vector<Eigen::Vector2d>& way);

}  // namespace beckon::simulation
