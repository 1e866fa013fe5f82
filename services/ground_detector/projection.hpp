// Projection of points of the ground with its derivative, without the checks of GroundCamera: it
// runs some 100 000 times a frame.
#pragma once

#include <Eigen/Core>

#include "common/ground_camera.hpp"

namespace beckon {

class GroundProjection {
 public:
  explicit GroundProjection(const GroundCamera& camera);

  // Point of the ground (m) to ideal pixel; false for points in or behind the camera's plane.
  bool operator()(const Eigen::Vector2d& point, Eigen::Vector2d& pixel) const {
    const Eigen::Vector3d homogeneous =
        image_from_ground_ * Eigen::Vector3d(point.x(), point.y(), 1.0);
    if (homogeneous.z() <= 1e-9) return false;
    pixel = homogeneous.head<2>() / homogeneous.z();
    return true;
  }

  // Also the derivative of the pixel by the point.
  bool operator()(const Eigen::Vector2d& point, Eigen::Vector2d& pixel,
                  Eigen::Matrix2d& pixel_by_point) const {
    const Eigen::Vector3d homogeneous =
        image_from_ground_ * Eigen::Vector3d(point.x(), point.y(), 1.0);
    if (homogeneous.z() <= 1e-9) return false;
    pixel = homogeneous.head<2>() / homogeneous.z();
    pixel_by_point =
        (image_from_ground_.topLeftCorner<2, 2>() - pixel * image_from_ground_.block<1, 2>(2, 0)) /
        homogeneous.z();
    return true;
  }

 private:
  Eigen::Matrix3d image_from_ground_;
};

}  // namespace beckon
