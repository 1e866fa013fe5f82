// The floor plan as light meets it: how far it is to the nearest wall in a direction, fast enough
// to ask for a million rays a second.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/floor_plan.hpp"
#include "common/grid.hpp"

namespace beckon {

class PlanField {
 public:
  // The resolution is doubled until the area has at most four million cells.
  explicit PlanField(const FloorPlan& plan, double resolution_m = 0.05);

  // Whether there is anything on the plan that a ray can meet.
  bool has_walls() const { return has_walls_; }
  // Whether the robot's camera can be there.
  bool IsFree(const Eigen::Vector2d& point) const;

  // Distance from `from` along `direction` (of length 1) to the first wall, right to within a cell;
  // infinity where there is none within `max_range_m` or before the end of the area. By sphere
  // tracing (Hart 1996) over the distance field.
  float Range(const Eigen::Vector2f& from, const Eigen::Vector2f& direction,
              float max_range_m) const;

  const GridGeometry& geometry() const { return geometry_; }

 private:
  GridGeometry geometry_;
  bool has_walls_ = false;
  // Per cell: from its middle to that of the nearest opaque cell, in cells.
  std::vector<float> distance_;
  std::vector<unsigned char> free_;
};

}  // namespace beckon
