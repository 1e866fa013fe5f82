// The free cells of a site's floor plan, numbered without gaps: the support of every posterior.
// Cells of one block have numbers side by side, so that what is kept of them lies side by side.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "common/floor_plan.hpp"
#include "common/grid.hpp"

namespace beckon {

struct FloorGridOptions {
  double resolution_m = 0.25;  // side of a cell, m; doubled until the area has at most max_cells
  int max_cells = 40000;
};

// Sums over all free cells of the centres and of their squares, about a point near them: sums about
// a far origin would lose the digits that matter.
struct Moments {
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // m, map frame
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
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
  const Moments& moments() const { return moments_; }
  // Number in the full geometry of each free cell.
  const std::vector<int>& geometry_index() const { return geometry_index_; }

  // The free cell nearest to a point, by straight line.
  int NearestCell(const Eigen::Vector2d& point) const;

  // Free cells in squares of kBlockSide x kBlockSide, so that a posterior need not be kept where it
  // is next to nothing.
  struct Block {
    std::vector<int> cells;       // free cells, at least one
    std::vector<int> neighbours;  // blocks around it that have free cells, up to eight
    int representative = 0;       // the cell nearest to the middle of its cells
  };
  static constexpr int kBlockSide = 4;
  const std::vector<Block>& blocks() const { return blocks_; }
  // The block of a free cell, and the cell's place in Block::cells.
  int block_of(int cell) const { return block_of_[static_cast<std::size_t>(cell)].first; }
  int place_in_block(int cell) const { return block_of_[static_cast<std::size_t>(cell)].second; }

  // Free cells to the east, west, north and south that a person can step to; -1 where there is a
  // wall, an obstacle or the end of the area.
  const std::array<int, 4>& neighbours(int cell) const {
    return neighbours_[static_cast<std::size_t>(cell)];
  }

 private:
  void MakeBlocks();

  GridGeometry geometry_;
  std::vector<Eigen::Vector2d> centres_;
  std::vector<int> geometry_index_;
  std::vector<int> cell_at_;  // per cell of the geometry: number of the free cell, -1
  std::vector<std::array<int, 4>> neighbours_;
  std::vector<Block> blocks_;
  Moments moments_;
  std::vector<std::pair<int, int>> block_of_;  // per free cell: block, place in it
};

}  // namespace beckon
