#include "services/navigator/route_planner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <queue>

namespace beckon {
namespace {

constexpr float kImpassable = -1.0F;
constexpr double kMaxCells = 1.5e6;
constexpr double kMaxClearanceM = 10.0;
// Where the robot itself stands is passable, however near things seem: at worst it has to get away.
constexpr double kEscapeM = 0.35;
constexpr float kEscapeCost = 15.0F;
// What was seen from further away than this may have been a trick of the light, a floor that looks
// like none, or a door that has been opened since: where there is no other way, it is worth a look.
constexpr double kFirmM = 1.2;
constexpr float kDoubtfulCost = 12.0F;
// What an end is worth: a metre nearer to the goal is worth this many metres of way.
constexpr double kNearnessWeight = 6.0;
// The caller wants the robot in the room, not behind its wall, even if the way is long.
constexpr double kBehindWallCost = 40.0;

double SteadySeconds(Instant now) { return std::chrono::duration<double>(now.steady).count(); }

// Distance of each cell to the nearest zero of the mask, with a border of zeros around it, m.
cv::Mat ClearanceOf(const cv::Mat& mask, double resolution_m, bool has_border) {
  cv::Mat framed;
  cv::copyMakeBorder(mask, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT,
                     cv::Scalar(has_border ? 0 : 255));
  if (cv::countNonZero(framed) == static_cast<int>(framed.total())) {
    return {mask.rows, mask.cols, CV_32FC1, cv::Scalar(kMaxClearanceM)};
  }
  cv::Mat clearance;
  cv::distanceTransform(framed, clearance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return clearance(cv::Rect(1, 1, mask.cols, mask.rows)) * resolution_m;
}

// Calls `visit` with points at most `step` apart from one end to the other; false as soon as it
// says so.
template <typename Visit>
bool Walk(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double step, Visit visit) {
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from).norm() / step)));
  for (int i = 0; i <= steps; ++i) {
    if (!visit(from + (to - from) * (static_cast<double>(i) / steps))) return false;
  }
  return true;
}

}  // namespace

// Cost per metre in each cell, at least 1; kImpassable where the disc cannot be.
struct RoutePlanner::CostMap {
  std::vector<float> per_metre;
  float operator[](int cell) const { return per_metre[static_cast<std::size_t>(cell)]; }
};

void ReadRouteOptions(ConfigTable& table, RouteOptions& options) {
  table.Optional("route_resolution_m", options.resolution_m, Range{0.02, 0.5});
  table.Optional("plan_tolerance_m", options.plan_tolerance_m, Range{0.0, 1.0});
  table.Optional("comfort_m", options.comfort_m, Range{0.01, 2.0});
  table.Optional("comfort_weight", options.comfort_weight, Range{0.0, 100.0});
  table.Optional("obstacle_memory_s", options.memory_s, Range{0.0, 3600.0});
}

RoutePlanner::RoutePlanner(const FloorPlan& plan, const RobotOptions& robot,
                           const RouteOptions& options)
    : robot_(robot), options_(options) {
  // Large sites get larger cells, so that a search stays within a fraction of a second.
  const Eigen::Vector2d extent = plan.max - plan.min;
  const double resolution =
      std::max(options.resolution_m, std::sqrt(extent.x() * extent.y() / kMaxCells));
  grid_ = GridGeometry::Covering(plan.min, plan.max, resolution);
  plan_free_ = plan.FreeMask(grid_);
  plan_clearance_ = ClearanceOf(plan_free_, resolution, true);
  seen_occupied_s_.assign(static_cast<std::size_t>(grid_.size()), -1.0);
}

void RoutePlanner::Remember(const SeenGrid& grid, const Pose2& map_from_grid, Instant now) {
  const Pose2 grid_from_map = map_from_grid.Inverse();
  const Eigen::Vector2d half_sides =
      0.5 * grid.grid.resolution_m * Eigen::Vector2d(grid.grid.width, grid.grid.height);
  const Eigen::Vector2d middle = map_from_grid * half_sides;
  const double reach = half_sides.norm();
  const int first_row = std::max(0, grid_.Row(middle.y() - reach));
  const int last_row = std::min(grid_.height - 1, grid_.Row(middle.y() + reach));
  const int first_column = std::max(0, grid_.Column(middle.x() - reach));
  const int last_column = std::min(grid_.width - 1, grid_.Column(middle.x() + reach));
  for (int row = first_row; row <= last_row; ++row) {
    for (int column = first_column; column <= last_column; ++column) {
      const int seen = grid.grid.IndexAt(grid_from_map * grid_.Centre(column, row));
      if (seen < 0) continue;
      const std::uint8_t occupancy = grid.occupancy[static_cast<std::size_t>(seen)];
      if (occupancy == SeenGrid::kUnknown) continue;
      seen_occupied_s_[static_cast<std::size_t>(grid_.Index(column, row))] =
          occupancy >= SeenGrid::kOccupiedFrom ? SteadySeconds(now) : -1.0;
    }
  }
}

void RoutePlanner::ForgetSeen() {
  std::fill(seen_occupied_s_.begin(), seen_occupied_s_.end(), -1.0);
}

bool RoutePlanner::IsFree(const Eigen::Vector2d& point) const {
  const int cell = grid_.IndexAt(point);
  return cell >= 0 && plan_free_.data[cell] != 0;
}

bool RoutePlanner::HasLineOfSight(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  bool has_left_wall = false;
  return Walk(from, to, 0.5 * grid_.resolution_m, [&](const Eigen::Vector2d& point) {
    if (IsFree(point)) {
      has_left_wall = true;
      return true;
    }
    return !has_left_wall;
  });
}

RoutePlanner::CostMap RoutePlanner::MakeCostMap(const cv::Mat& firm_clearance,
                                                const cv::Mat& seen_clearance,
                                                const Eigen::Vector2d& base) const {
  CostMap costs;
  costs.per_metre.resize(static_cast<std::size_t>(grid_.size()));
  const auto* plan = plan_clearance_.ptr<float>();
  const auto* firm = firm_clearance.ptr<float>();
  const auto* seen = seen_clearance.ptr<float>();
  const double half_cell = 0.5 * grid_.resolution_m;
  // Seen obstacles reach to the near side of their cells; walls of the plan are lines through
  // theirs.
  const double seen_radius = robot_.radius_m + half_cell;
  const double plan_radius = std::max(half_cell, robot_.radius_m - options_.plan_tolerance_m);
  for (int cell = 0; cell < grid_.size(); ++cell) {
    float& cost = costs.per_metre[static_cast<std::size_t>(cell)];
    const bool is_passable = plan[cell] >= plan_radius && firm[cell] >= seen_radius;
    if (!is_passable) {
      const bool may_escape = plan[cell] > half_cell && firm[cell] > half_cell &&
                              (grid_.Centre(cell) - base).norm() < kEscapeM;
      cost = may_escape ? kEscapeCost : kImpassable;
      continue;
    }
    if (seen[cell] < seen_radius) {
      cost = kDoubtfulCost;
      continue;
    }
    const double around = std::min<double>(plan[cell], seen[cell] - half_cell) - robot_.radius_m;
    const double lack = std::max(0.0, 1.0 - around / options_.comfort_m);
    cost = static_cast<float>(1.0 + options_.comfort_weight * lack * lack);
  }
  return costs;
}

int RoutePlanner::NearestPassable(const CostMap& costs, const Eigen::Vector2d& point) const {
  int nearest = -1;
  double least = kEscapeM;
  const int reach = static_cast<int>(std::ceil(kEscapeM / grid_.resolution_m));
  const int column = grid_.Column(point.x());
  const int row = grid_.Row(point.y());
  for (int y = row - reach; y <= row + reach; ++y) {
    for (int x = column - reach; x <= column + reach; ++x) {
      if (!grid_.Contains(x, y) || costs[grid_.Index(x, y)] == kImpassable) continue;
      const double distance = (grid_.Centre(x, y) - point).norm();
      if (distance < least) {
        least = distance;
        nearest = grid_.Index(x, y);
      }
    }
  }
  return nearest;
}

std::vector<int> RoutePlanner::Search(const CostMap& costs, int start,
                                      const RouteGoal& goal) const {
  struct Entry {
    float estimate;
    int cell;
    bool operator>(const Entry& other) const { return estimate > other.estimate; }
  };
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto size = static_cast<std::size_t>(grid_.size());
  std::vector<float> cost_to_go(size, kInfinity);
  std::vector<int> next(size, -1);
  std::vector<bool> is_settled(size, false);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const Eigen::Vector2d start_point = grid_.Centre(start);
  const auto push = [&](int cell, float cost, int from) {
    if (cost >= cost_to_go[static_cast<std::size_t>(cell)]) return;
    cost_to_go[static_cast<std::size_t>(cell)] = cost;
    next[static_cast<std::size_t>(cell)] = from;
    open.push({cost + static_cast<float>((grid_.Centre(cell) - start_point).norm()), cell});
  };

  const int reach = static_cast<int>(std::ceil(goal.reach_m / grid_.resolution_m));
  const int goal_column = grid_.Column(goal.point.x());
  const int goal_row = grid_.Row(goal.point.y());
  for (int row = goal_row - reach; row <= goal_row + reach; ++row) {
    for (int column = goal_column - reach; column <= goal_column + reach; ++column) {
      if (!grid_.Contains(column, row)) continue;
      const int cell = grid_.Index(column, row);
      const double distance = (grid_.Centre(cell) - goal.point).norm();
      if (costs[cell] == kImpassable || distance > goal.reach_m) continue;
      const bool is_behind_wall = !HasLineOfSight(goal.point, grid_.Centre(cell));
      push(
          cell,
          static_cast<float>(kNearnessWeight * distance + (is_behind_wall ? kBehindWallCost : 0.0)),
          -1);
    }
  }
  while (!open.empty()) {
    const int cell = open.top().cell;
    open.pop();
    if (is_settled[static_cast<std::size_t>(cell)]) continue;
    is_settled[static_cast<std::size_t>(cell)] = true;
    if (cell == start) break;
    const int column = cell % grid_.width;
    const int row = cell / grid_.width;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if ((dx == 0 && dy == 0) || !grid_.Contains(column + dx, row + dy)) continue;
        const int neighbour = grid_.Index(column + dx, row + dy);
        if (costs[neighbour] == kImpassable) continue;
        const double length = grid_.resolution_m * (dx != 0 && dy != 0 ? std::numbers::sqrt2 : 1.0);
        const auto step = static_cast<float>(length) * 0.5F * (costs[cell] + costs[neighbour]);
        push(neighbour, cost_to_go[static_cast<std::size_t>(cell)] + step, cell);
      }
    }
  }
  std::vector<int> cells;
  if (!is_settled[static_cast<std::size_t>(start)]) return cells;
  for (int cell = start; cell >= 0; cell = next[static_cast<std::size_t>(cell)])
    cells.push_back(cell);
  return cells;
}

std::vector<Eigen::Vector2d> RoutePlanner::Shorten(const CostMap& costs,
                                                   const std::vector<int>& cells) const {
  std::vector<double> cost_up_to = {0.0};
  for (std::size_t i = 1; i < cells.size(); ++i) {
    const double length = (grid_.Centre(cells[i]) - grid_.Centre(cells[i - 1])).norm();
    cost_up_to.push_back(cost_up_to.back() +
                         length * 0.5 * (costs[cells[i]] + costs[cells[i - 1]]));
  }
  const auto straight_cost = [&](std::size_t from, std::size_t to) {
    const Eigen::Vector2d a = grid_.Centre(cells[from]);
    const Eigen::Vector2d b = grid_.Centre(cells[to]);
    double sum = 0.0;
    int count = 0;
    const bool is_passable =
        Walk(a, b, 0.5 * grid_.resolution_m, [&](const Eigen::Vector2d& point) {
          const float cost = costs[grid_.IndexAt(point)];
          sum += cost;
          ++count;
          return cost != kImpassable;
        });
    return is_passable ? sum / count * (b - a).norm() : std::numeric_limits<double>::infinity();
  };

  std::vector<Eigen::Vector2d> points = {grid_.Centre(cells.front())};
  std::size_t from = 0;
  while (from + 1 < cells.size()) {
    std::size_t to = from + 1;
    // Gallops ahead in doubled strides, then halves them down to where the straight line starts to
    // cost more.
    bool is_galloping = true;
    for (std::size_t stride = 1; stride > 0; stride = is_galloping ? 2 * stride : stride / 2) {
      const bool is_no_dearer =
          to + stride < cells.size() &&
          straight_cost(from, to + stride) <= cost_up_to[to + stride] - cost_up_to[from] + 1e-3;
      if (is_no_dearer) to += stride;
      is_galloping = is_galloping && is_no_dearer;
    }
    points.push_back(grid_.Centre(cells[to]));
    from = to;
  }
  return points;
}

cv::Mat RoutePlanner::SeenClearance(const Eigen::Vector2d& base, double within_m, Instant now,
                                    const std::vector<Eigen::Vector2d>& hidden) const {
  const double oldest = std::max(0.0, SteadySeconds(now) - options_.memory_s);
  cv::Mat not_occupied(grid_.height, grid_.width, CV_8UC1, cv::Scalar(255));
  for (int cell = 0; cell < grid_.size(); ++cell) {
    if (seen_occupied_s_[static_cast<std::size_t>(cell)] >= oldest &&
        (grid_.Centre(cell) - base).norm() <= within_m) {
      not_occupied.data[cell] = 0;
    }
  }
  for (const Eigen::Vector2d& point : hidden) {
    const int cell = grid_.IndexAt(point);
    if (cell >= 0) not_occupied.data[cell] = 0;
  }
  return ClearanceOf(not_occupied, grid_.resolution_m, false);
}

Route RoutePlanner::Plan(const Eigen::Vector2d& base, const RouteGoal& goal, Instant now,
                         const std::vector<Eigen::Vector2d>& hidden) const {
  const cv::Mat seen = SeenClearance(base, std::numeric_limits<double>::infinity(), now, hidden);
  Route route = PlanWith(MakeCostMap(seen, seen, base), base, goal);
  if (!route.is_found) {
    route = PlanWith(MakeCostMap(SeenClearance(base, kFirmM, now, hidden), seen, base), base, goal);
    route.is_doubtful = route.is_found;
  }
  if (route.is_found) {
    route.plan_has_way = true;
  } else {
    const cv::Mat nothing(grid_.height, grid_.width, CV_32FC1, cv::Scalar(kMaxClearanceM));
    route.plan_has_way = PlanWith(MakeCostMap(nothing, nothing, base), base, goal).is_found;
  }
  return route;
}

Route RoutePlanner::PlanWith(const CostMap& costs, const Eigen::Vector2d& base,
                             const RouteGoal& goal) const {
  Route route;
  const int start = NearestPassable(costs, base);
  if (start < 0) return route;
  const std::vector<int> cells = Search(costs, start, goal);
  if (cells.empty()) return route;
  route.is_found = true;
  route.points = Shorten(costs, cells);
  route.points.front() = base;
  for (std::size_t i = 1; i < route.points.size(); ++i) {
    route.length_m += (route.points[i] - route.points[i - 1]).norm();
  }
  return route;
}

}  // namespace beckon
