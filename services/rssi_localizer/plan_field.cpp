#include "services/rssi_localizer/plan_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace beckon {
namespace {

constexpr double kMaxCells = 4e6;

// Everything that ends a ray is zero, all else 255. The end of the area is no wall.
cv::Mat DrawTransparent(const FloorPlan& plan, const GridGeometry& grid) {
  cv::Mat transparent(grid.height, grid.width, CV_8UC1, cv::Scalar(255));
  for (const Wall& face : plan.Faces()) ClearAlong(face, grid, transparent);
  if (plan.image) {
    for (int row = 0; row < grid.height; ++row) {
      for (int column = 0; column < grid.width; ++column) {
        const int index = plan.image->grid.IndexAt(grid.Centre(column, row));
        const bool is_free =
            index >= 0 && plan.image->free.at<unsigned char>(index / plan.image->grid.width,
                                                             index % plan.image->grid.width) != 0;
        if (!is_free) transparent.at<unsigned char>(row, column) = 0;
      }
    }
  }
  return transparent;
}

}  // namespace

PlanField::PlanField(const FloorPlan& plan, double resolution_m) {
  const Eigen::Vector2d extent = plan.max - plan.min;
  while (extent.prod() / (resolution_m * resolution_m) > kMaxCells) resolution_m *= 2.0;
  // A cell more on each side, so that walls along the border of the area have cells of their own.
  const Eigen::Vector2d border = Eigen::Vector2d::Constant(resolution_m);
  geometry_ = GridGeometry::Covering(plan.min - border, plan.max + border, resolution_m);

  const cv::Mat transparent = DrawTransparent(plan, geometry_);
  has_walls_ = cv::countNonZero(transparent) < geometry_.size();
  const auto cells = static_cast<std::size_t>(geometry_.size());
  distance_.assign(cells, static_cast<float>(geometry_.width + geometry_.height));
  if (has_walls_) {
    cv::Mat distance;
    cv::distanceTransform(transparent, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    std::copy(distance.begin<float>(), distance.end<float>(), distance_.begin());
  }
  const cv::Mat free = plan.FreeMask(geometry_);
  free_.assign(free.begin<unsigned char>(), free.end<unsigned char>());
}

bool PlanField::IsFree(const Eigen::Vector2d& point) const {
  const int index = geometry_.IndexAt(point);
  return index >= 0 && free_[static_cast<std::size_t>(index)] != 0;
}

float PlanField::Range(const Eigen::Vector2f& from, const Eigen::Vector2f& direction,
                       float max_range_m) const {
  // A wall may begin a cell's diagonal earlier than the distance from middle to middle says.
  constexpr float kDiagonal = 1.42F;
  constexpr float kLeastStep = 0.7F;
  constexpr float kInWall = 2.0F;
  const auto resolution = static_cast<float>(geometry_.resolution_m);
  float column = (from.x() - static_cast<float>(geometry_.origin.x())) / resolution;
  float row = (from.y() - static_cast<float>(geometry_.origin.y())) / resolution;
  const float longest = max_range_m / resolution;
  float gone = 0.0F;
  // A camera that seems to be in a wall stands close before it.
  bool is_before_wall = false;
  while (gone <= longest) {
    const float x = column + gone * direction.x();
    const float y = row + gone * direction.y();
    if (!(x >= 0.0F && y >= 0.0F)) break;
    const auto cell_x = static_cast<int>(x);
    const auto cell_y = static_cast<int>(y);
    if (!geometry_.Contains(cell_x, cell_y)) break;
    const float distance = distance_[static_cast<std::size_t>(geometry_.Index(cell_x, cell_y))];
    if (distance >= 0.5F) {
      is_before_wall = true;
    } else if (is_before_wall || gone > kInWall) {
      return gone * resolution;
    }
    gone += std::max(kLeastStep, distance - kDiagonal);
  }
  return std::numeric_limits<float>::infinity();
}

}  // namespace beckon
