#include "tools/simulation/lighting.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace beckon::simulation {
namespace {

constexpr double kLampHeightM = 2.4;
constexpr double kCastShadow = 0.3;  // share of the light that a cast shadow takes away
constexpr double kCastShadowBlurM = 0.06;

double DistanceToRoom(const Room& room, const Eigen::Vector2d& point) {
  const Eigen::Vector2d outside = (room.min - point).cwiseMax(point - room.max).cwiseMax(0.0);
  return outside.norm();
}

std::vector<Eigen::Vector2d> Corners(const Solid& solid) {
  if (!solid.is_cylinder()) return solid.footprint;
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < 24; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 24;
    corners.push_back(solid.centre +
                      solid.radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return corners;
}

}  // namespace

float ContactShade(float distance_m) {
  return 1.0F - 0.38F * std::exp(-std::max(0.0F, distance_m) / 0.05F);
}

Lighting::Lighting(const World& world, Random& random) : rooms_(world.rooms) {
  for (const Room& room : rooms_) {
    const Eigen::Vector2d size = room.max - room.min;
    const Eigen::Vector2d place =
        room.min + size.cwiseProduct(random.UniformIn({0.3, 0.3}, {0.7, 0.7}));
    const auto ambient = static_cast<float>(random.Uniform(0.55, 0.8));
    lamps_.push_back({{place.x(), place.y(), kLampHeightM}, 1.2F - ambient, ambient});
  }
}

std::size_t Lighting::NearestRoom(const Eigen::Vector2d& point) const {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < rooms_.size(); ++i) {
    if (DistanceToRoom(rooms_[i], point) < DistanceToRoom(rooms_[nearest], point)) nearest = i;
  }
  return nearest;
}

float Lighting::OnFloorUnshadowed(const Eigen::Vector2d& point) const {
  const Lamp& lamp = lamps_[NearestRoom(point)];
  const double distance = std::hypot(kLampHeightM, (lamp.position.head<2>() - point).norm());
  return lamp.ambient + lamp.strength * static_cast<float>(std::pow(kLampHeightM / distance, 3.0));
}

float Lighting::OnUpright(const Eigen::Vector2d& point, const Eigen::Vector2d& normal) const {
  if (lamps_.empty()) return 1.0F;
  constexpr double kMiddleM = 0.4;  // height that stands for the part which a low camera sees
  const Lamp& lamp = lamps_[NearestRoom(point + 0.03 * normal)];
  const Eigen::Vector3d to_lamp = lamp.position - Eigen::Vector3d(point.x(), point.y(), kMiddleM);
  const double cosine = std::max(0.0, normal.dot(to_lamp.head<2>()) / to_lamp.norm());
  const double falloff = kLampHeightM * kLampHeightM / to_lamp.squaredNorm();
  return 0.8F * lamp.ambient +
         lamp.strength * static_cast<float>(std::min(1.0, 1.3 * cosine * falloff));
}

void Lighting::DarkenCastShadows(const World& world, cv::Mat& light) const {
  cv::Mat lit(light.size(), CV_32FC1, cv::Scalar(1.0));
  const auto pixel = [&](const Eigen::Vector2d& point) {
    const Eigen::Vector2d cell = (point - world.min) / kCellM;
    return cv::Point2f(static_cast<float>(cell.x()), static_cast<float>(cell.y()));
  };
  for (const Solid& solid : world.solids) {
    if (solid.kind == SolidKind::kWall) continue;
    const std::size_t room = NearestRoom(solid.centre);
    const Eigen::Vector2d lamp = lamps_[room].position.head<2>();
    const double height = std::min(solid.height_m, 1.5);  // longer shadows end on walls
    std::vector<cv::Point2f> outline;
    for (const Eigen::Vector2d& corner : Corners(solid)) {
      outline.push_back(pixel(corner));
      outline.push_back(pixel(corner + (corner - lamp) * height / (kLampHeightM - height)));
    }
    std::vector<cv::Point2f> hull;
    cv::convexHull(outline, hull);
    std::vector<cv::Point> cells;
    for (const cv::Point2f& point : hull) cells.emplace_back(cvRound(point.x), cvRound(point.y));
    cv::Mat shadow(light.size(), CV_8UC1, cv::Scalar(0));
    cv::fillConvexPoly(shadow, cells, cv::Scalar(255));
    cv::Mat in_room(light.size(), CV_8UC1, cv::Scalar(0));
    const cv::Point2f low = pixel(rooms_[room].min);
    const cv::Point2f high = pixel(rooms_[room].max);
    cv::rectangle(in_room, cv::Point(cvRound(low.x), cvRound(low.y)),
                  cv::Point(cvRound(high.x), cvRound(high.y)), cv::Scalar(255), cv::FILLED);
    lit.setTo(1.0 - kCastShadow, shadow & in_room);
  }
  cv::GaussianBlur(lit, lit, {}, kCastShadowBlurM / kCellM);
  light = light.mul(lit);
}

cv::Mat Lighting::OnFloor(const World& world) const {
  const GridGeometry grid = GridGeometry::Covering(world.min, world.max, kCellM);
  cv::Mat light(grid.height, grid.width, CV_32FC1, cv::Scalar(1.0));
  if (lamps_.empty()) return light;
  cv::Mat open(grid.height, grid.width, CV_8UC1, cv::Scalar(255));
  for (int row = 0; row < grid.height; ++row) {
    for (int column = 0; column < grid.width; ++column) {
      light.at<float>(row, column) = OnFloorUnshadowed(grid.Centre(column, row));
    }
  }
  for (const Solid& solid : world.solids) {
    std::vector<cv::Point> cells;
    for (const Eigen::Vector2d& corner : Corners(solid)) {
      const Eigen::Vector2d cell = (corner - world.min) / kCellM;
      cells.emplace_back(cvRound(cell.x() - 0.5), cvRound(cell.y() - 0.5));
    }
    cv::fillConvexPoly(open, cells, cv::Scalar(0));
  }
  // Light comes through doors: no hard step where one room ends and the other begins.
  cv::GaussianBlur(light, light, {}, 0.08 / kCellM);
  DarkenCastShadows(world, light);
  // The outer walls shade the floor too: one more row of closed cells all round.
  cv::Mat closed, distance;
  cv::copyMakeBorder(open, closed, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(closed, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  for (int row = 0; row < grid.height; ++row) {
    for (int column = 0; column < grid.width; ++column) {
      const float cells = distance.at<float>(row + 1, column + 1) - 0.5F;
      light.at<float>(row, column) *= ContactShade(cells * static_cast<float>(kCellM));
    }
  }
  return light;
}

}  // namespace beckon::simulation
