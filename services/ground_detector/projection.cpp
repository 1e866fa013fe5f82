#include "services/ground_detector/projection.hpp"

#include <Eigen/LU>

namespace beckon {

GroundProjection::GroundProjection(const GroundCamera& camera)
    : image_from_ground_(camera.ground_from_image.inverse()) {
  // The sign of a homography is free: here the third coordinate is positive for what lies before
  // the camera, as the ground at the bottom centre of the picture does.
  const Eigen::Vector3d ground =
      camera.ground_from_image * Eigen::Vector3d(camera.cx, camera.height - 1.0, 1.0);
  const Eigen::Vector3d point(ground.x() / ground.z(), ground.y() / ground.z(), 1.0);
  if ((image_from_ground_ * point).z() < 0.0) image_from_ground_ = -image_from_ground_;
}

}  // namespace beckon
