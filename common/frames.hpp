// Frames and planar poses.
//
// Robot frame: x forward, y left, z up, origin on the ground below the camera. Map frame: that of
// the site file. Odometry frame: starts anywhere and drifts. Poses are named a_from_b:
// `map_from_robot` takes robot coordinates to map coordinates, and map_from_robot *
// robot_from_camera == map_from_camera.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

namespace beckon {

// The same angle in (-pi, pi].
inline double WrapAngle(double angle_rad) {
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  const double wrapped = angle_rad - kTwoPi * std::ceil((angle_rad - std::numbers::pi) / kTwoPi);
  return wrapped;
}

inline constexpr double RadiansFromDegrees(double degrees) {
  return degrees * std::numbers::pi / 180.0;
}
inline constexpr double DegreesFromRadians(double radians) {
  return radians * 180.0 / std::numbers::pi;
}

// A rigid motion of the plane, SE(2).
struct Pose2 {
  double x = 0.0;      // m
  double y = 0.0;      // m
  double theta = 0.0;  // rad, counter-clockwise from x

  Eigen::Vector2d translation() const { return {x, y}; }
  bool IsFinite() const { return std::isfinite(x) && std::isfinite(y) && std::isfinite(theta); }

  // a_from_c = a_from_b * b_from_c.
  Pose2 operator*(const Pose2& other) const {
    const Eigen::Vector2d moved = *this * other.translation();
    return {moved.x(), moved.y(), WrapAngle(theta + other.theta)};
  }

  // point_in_a = a_from_b * point_in_b.
  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const {
    const double c = std::cos(theta);
    const double s = std::sin(theta);
    return {x + c * point.x() - s * point.y(), y + s * point.x() + c * point.y()};
  }

  Pose2 Inverse() const {
    const double c = std::cos(theta);
    const double s = std::sin(theta);
    return {-c * x - s * y, s * x - c * y, WrapAngle(-theta)};
  }
};

}  // namespace beckon
