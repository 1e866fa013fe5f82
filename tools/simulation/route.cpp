#include "tools/simulation/route.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace beckon::simulation {
namespace {

// Pulls the string tight: leaves out points that a straight line can pass by.
std::vector<Eigen::Vector2d> Shorten(const ClearanceMap& map,
                                     const std::vector<Eigen::Vector2d>& way, double radius_m) {
  std::vector<Eigen::Vector2d> result{way.front()};
  std::size_t at = 0;
  while (at + 1 < way.size()) {
    std::size_t next = at + 1;
    for (std::size_t candidate = way.size() - 1; candidate > next; --candidate) {
      if (map.LineIsFree(way[at], way[candidate], radius_m)) {
        next = candidate;
        break;
      }
    }
    result.push_back(way[next]);
    at = next;
  }
  return result;
}

}  // namespace

std::vector<Eigen::Vector2d> ShortestWay(const ClearanceMap& map, const Eigen::Vector2d& start,
                                         const Eigen::Vector2d& goal, double reach_m,
                                         double radius_m) {
  const int first = map.grid.IndexAt(start);
  if (first < 0) return {};
  const auto cells = static_cast<std::size_t>(map.grid.size());
  std::vector<double> cost(cells, std::numeric_limits<double>::infinity());
  std::vector<int> before(cells, -1);
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[static_cast<std::size_t>(first)] = 0.0;
  open.emplace(0.0, first);
  while (!open.empty()) {
    const auto [so_far, cell] = open.top();
    open.pop();
    if (so_far > cost[static_cast<std::size_t>(cell)]) continue;
    if ((map.grid.Centre(cell) - goal).norm() <= reach_m) {
      std::vector<Eigen::Vector2d> way;
      for (int i = cell; i >= 0; i = before[static_cast<std::size_t>(i)])
        way.push_back(map.grid.Centre(i));
      std::reverse(way.begin(), way.end());
      way.front() = start;
      return Shorten(map, way, radius_m);
    }
    const int row = cell / map.grid.width;
    const int column = cell % map.grid.width;
    for (int dr = -1; dr <= 1; ++dr) {
      for (int dc = -1; dc <= 1; ++dc) {
        if ((dr == 0 && dc == 0) || !map.grid.Contains(column + dc, row + dr)) continue;
        const int next = map.grid.Index(column + dc, row + dr);
        if (map.distance_m.at<float>(row + dr, column + dc) < radius_m) continue;
        const double total = so_far + map.grid.resolution_m * std::hypot(dr, dc);
        if (total >= cost[static_cast<std::size_t>(next)]) continue;
        cost[static_cast<std::size_t>(next)] = total;
        before[static_cast<std::size_t>(next)] = cell;
        open.emplace(total, next);
      }
    }
  }
  return {};
}

double LengthOf(const std::vector<Eigen::Vector2d>& way) {
  double length = 0.0;
  for (std::size_t i = 1; i < way.size(); ++i) length += (way[i] - way[i - 1]).norm();
  return length;
}

}  // namespace beckon::simulation
