// The floor plan of a site: where one can walk, and what radio and light have to pass through.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/grid.hpp"

namespace beckon {

using Polygon = std::vector<Eigen::Vector2d>;  // m, map frame; last point joins the first

struct Wall {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();  // m, map frame
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  std::optional<double> attenuation_db;  // of radio through it, where known
};

// A picture of the floor: white (>= 128) is free.
struct MapImage {
  cv::Mat free;  // CV_8UC1, non-zero where free; row 0 at the smallest y (unlike in the file)
  GridGeometry grid;
};

struct FloorPlan {
  Eigen::Vector2d min = Eigen::Vector2d::Zero();  // of the area, m, map frame
  Eigen::Vector2d max = Eigen::Vector2d::Zero();
  Polygon outline;                 // walkable inside; empty: the whole area
  std::vector<Wall> walls;         // of no thickness
  std::vector<Polygon> obstacles;  // not walkable inside
  std::optional<MapImage> image;

  // Whether a point is in the area, inside the outline, outside all obstacles and free in the
  // image.
  bool IsFree(const Eigen::Vector2d& point) const;

  // 255 in cells whose centre is free and that no wall passes through, else 0. CV_8UC1, height x
  // width.
  cv::Mat FreeMask(const GridGeometry& grid) const;

  // All straight faces: walls, edges of the outline and of the obstacles. Not the area's border.
  std::vector<Wall> Faces() const;

  // Distance from `from` along `bearing_rad` (map frame) to the nearest face; infinity where there
  // is none within `max_range_m`. The map image counts, walked at its own resolution.
  double CastRay(const Eigen::Vector2d& from, double bearing_rad, double max_range_m) const;
};

// Clears the cells of the mask (CV_8UC1) that the wall passes through.
void ClearAlong(const Wall& wall, const GridGeometry& grid, cv::Mat& mask);

// Whether the closed segments a-b and c-d meet.
bool SegmentsMeet(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                  const Eigen::Vector2d& d);
// Even-odd rule.
bool IsInside(const Polygon& polygon, const Eigen::Vector2d& point);

}  // namespace beckon
