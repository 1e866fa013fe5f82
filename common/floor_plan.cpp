#include "common/floor_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace beckon {
namespace {

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// -1, 0, +1: on which side of a-b the point c lies.
int Side(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const double area = Cross(b - a, c - a);
  return area > 0.0 ? 1 : (area < 0.0 ? -1 : 0);
}

// For c on the line through a and b: whether it lies between them.
bool IsBetween(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return c.x() >= std::min(a.x(), b.x()) && c.x() <= std::max(a.x(), b.x()) &&
         c.y() >= std::min(a.y(), b.y()) && c.y() <= std::max(a.y(), b.y());
}

void AppendEdges(const Polygon& polygon, std::vector<Wall>& faces) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& from = polygon[i];
    const Eigen::Vector2d& to = polygon[(i + 1) % polygon.size()];
    if (from != to) faces.push_back({from, to, std::nullopt});
  }
}

// Distance along the ray to where it meets the segment; infinity where it does not.
double RayToSegment(const Eigen::Vector2d& from, const Eigen::Vector2d& direction,
                    const Wall& wall) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::Vector2d edge = wall.to - wall.from;
  const double denominator = Cross(direction, edge);
  if (std::abs(denominator) < 1e-12) return kInfinity;
  const Eigen::Vector2d offset = wall.from - from;
  const double along_ray = Cross(offset, edge) / denominator;
  const double along_wall = Cross(offset, direction) / denominator;
  return along_ray >= 0.0 && along_wall >= 0.0 && along_wall <= 1.0 ? along_ray : kInfinity;
}

}  // namespace

void ClearAlong(const Wall& wall, const GridGeometry& grid, cv::Mat& mask) {
  const Eigen::Vector2d delta = wall.to - wall.from;
  const int steps =
      std::max(1, static_cast<int>(std::ceil(delta.norm() / (0.25 * grid.resolution_m))));
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d point = wall.from + delta * (static_cast<double>(i) / steps);
    const int column = grid.Column(point.x());
    const int row = grid.Row(point.y());
    if (grid.Contains(column, row)) mask.at<std::uint8_t>(row, column) = 0;
  }
}

bool SegmentsMeet(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                  const Eigen::Vector2d& d) {
  const int c_side = Side(a, b, c);
  const int d_side = Side(a, b, d);
  const int a_side = Side(c, d, a);
  const int b_side = Side(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) return true;
  return (c_side == 0 && IsBetween(a, b, c)) || (d_side == 0 && IsBetween(a, b, d)) ||
         (a_side == 0 && IsBetween(c, d, a)) || (b_side == 0 && IsBetween(c, d, b));
}

bool IsInside(const Polygon& polygon, const Eigen::Vector2d& point) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[j];
    if ((a.y() > point.y()) != (b.y() > point.y()) &&
        point.x() < a.x() + (b.x() - a.x()) * (point.y() - a.y()) / (b.y() - a.y())) {
      inside = !inside;
    }
  }
  return inside;
}

bool FloorPlan::IsFree(const Eigen::Vector2d& point) const {
  if ((point.array() < min.array()).any() || (point.array() > max.array()).any()) return false;
  if (!outline.empty() && !IsInside(outline, point)) return false;
  for (const auto& obstacle : obstacles) {
    if (IsInside(obstacle, point)) return false;
  }
  if (image) {
    const int column = image->grid.Column(point.x());
    const int row = image->grid.Row(point.y());
    if (!image->grid.Contains(column, row) || image->free.at<std::uint8_t>(row, column) == 0)
      return false;
  }
  return true;
}

cv::Mat FloorPlan::FreeMask(const GridGeometry& grid) const {
  cv::Mat mask(grid.height, grid.width, CV_8UC1);
  for (int row = 0; row < grid.height; ++row) {
    for (int column = 0; column < grid.width; ++column) {
      mask.at<std::uint8_t>(row, column) = IsFree(grid.Centre(column, row)) ? 255 : 0;
    }
  }
  for (const Wall& wall : walls) ClearAlong(wall, grid, mask);
  return mask;
}

std::vector<Wall> FloorPlan::Faces() const {
  std::vector<Wall> faces = walls;
  AppendEdges(outline, faces);
  for (const auto& obstacle : obstacles) AppendEdges(obstacle, faces);
  return faces;
}

double FloorPlan::CastRay(const Eigen::Vector2d& from, double bearing_rad,
                          double max_range_m) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::Vector2d direction(std::cos(bearing_rad), std::sin(bearing_rad));
  double range = kInfinity;
  for (const Wall& face : Faces()) range = std::min(range, RayToSegment(from, direction, face));
  if (image) {
    const double step = 0.5 * image->grid.resolution_m;
    // Outside the image all is blocked, so no ray is longer than this.
    const double longest = std::min(
        {range, max_range_m, image->grid.resolution_m * (image->grid.width + image->grid.height)});
    const int steps = static_cast<int>(std::ceil(longest / step));
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector2d point = from + i * step * direction;
      const int column = image->grid.Column(point.x());
      const int row = image->grid.Row(point.y());
      const bool is_free =
          image->grid.Contains(column, row) && image->free.at<std::uint8_t>(row, column) != 0;
      if (!is_free) {
        range = i * step;
        break;
      }
    }
  }
  return range <= max_range_m ? range : kInfinity;
}

}  // namespace beckon
