// The free cells of a site's floor plan, numbered without gaps: the support of every posterior.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/floor_plan.hpp"
#include "common/grid.hpp"

namespace beckon {

struct FloorGridOptions {
  double resolution_m = 0.25;  // side of a cell, m; doubled until the area has at most max_cells
  int max_cells = 40000;
};

class FloorGrid {
 public:
  // Cells of the plan's area that are free, and those that hold one of `known_free`: a place where
  // a calibration reading was taken is walkable, whatever the drawing says. Throws
  // std::invalid_argument where no cell is free.
  FloorGrid(const FloorPlan& plan, const FloorGridOptions& options,
            const std::vector<Eigen::Vector2d>& known_free = {});

  int size() const { return static_cast<int>(centres_.size()); }
  const GridGeometry& geometry() const { return geometry_; }
  double cell_area_m2() const { return geometry_.resolution_m * geometry_.resolution_m; }

  const std::vector<Eigen::Vector2d>& centres() const { return centres_; }  // m, map frame
  // Number in the full geometry of each free cell, ascending.
  const std::vector<int>& geometry_index() const { return geometry_index_; }

  // The free cell nearest to a point, by straight line.
  int NearestCell(const Eigen::Vector2d& point) const;

  // Free cells to the east, west, north and south that a person can step to; -1 where there is a
  // wall, an obstacle or the end of the area.
  const std::array<int, 4>& neighbours(int cell) const {
    return neighbours_[static_cast<std::size_t>(cell)];
  }

 private:
  GridGeometry geometry_;
  std::vector<Eigen::Vector2d> centres_;
  std::vector<int> geometry_index_;
  std::vector<int> cell_at_;  // per cell of the geometry: number of the free cell, -1
  std::vector<std::array<int, 4>> neighbours_;
};

}  // namespace beckon
