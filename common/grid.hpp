// A regular grid of square cells over a rectangle of the plane.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <stdexcept>

namespace beckon {

// Cell (column, row) covers origin + [column, column + 1) x [row, row + 1) times the resolution;
// row 0 has the smallest y. Cells are numbered row by row.
struct GridGeometry {
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // outer corner of cell (0, 0), m
  double resolution_m = 0.1;
  int width = 0;   // cells along x
  int height = 0;  // cells along y

  // The smallest grid of this resolution, starting at `min`, that covers [min, max].
  static GridGeometry Covering(const Eigen::Vector2d& min, const Eigen::Vector2d& max,
                               double resolution_m) {
    if (!(resolution_m > 0.0)) throw std::invalid_argument("a grid needs a positive resolution");
    if (!(max.x() > min.x() && max.y() > min.y()))
      throw std::invalid_argument("a grid needs a positive extent");
    // The small allowance keeps 3.0 m / 0.1 m at 30 cells in floating point.
    const Eigen::Vector2d cells = ((max - min) / resolution_m).array() - 1e-9;
    if (cells.maxCoeff() > 1e5 || cells.prod() > 1e8)
      throw std::invalid_argument("a grid of more than 100000 cells a side or 10^8 in all");
    return {min, resolution_m, static_cast<int>(std::ceil(cells.x())),
            static_cast<int>(std::ceil(cells.y()))};
  }

  int size() const { return width * height; }
  bool Contains(int column, int row) const {
    return column >= 0 && column < width && row >= 0 && row < height;
  }
  int Index(int column, int row) const { return row * width + column; }

  int Column(double x) const {
    return static_cast<int>(std::floor((x - origin.x()) / resolution_m));
  }
  int Row(double y) const { return static_cast<int>(std::floor((y - origin.y()) / resolution_m)); }

  // Number of the cell that holds the point, -1 outside the grid.
  int IndexAt(const Eigen::Vector2d& point) const {
    const int column = Column(point.x());
    const int row = Row(point.y());
    return Contains(column, row) ? Index(column, row) : -1;
  }

  Eigen::Vector2d Centre(int column, int row) const {
    return origin + resolution_m * Eigen::Vector2d(column + 0.5, row + 0.5);
  }
  Eigen::Vector2d Centre(int index) const { return Centre(index % width, index / width); }
};

}  // namespace beckon
