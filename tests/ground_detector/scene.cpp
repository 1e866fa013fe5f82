#include "tests/ground_detector/scene.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace beckon::testing {
namespace {

// A number in [0, 1) for each cell of a lattice.
double Hash(int x, int y) {
  auto value =
      static_cast<std::uint32_t>(x) * 374761393U + static_cast<std::uint32_t>(y) * 668265263U;
  value = (value ^ (value >> 13U)) * 1274126177U;
  return static_cast<double>((value ^ (value >> 16U)) & 0xffffU) / 65536.0;
}

// Smooth noise with features of 1 unit, in [0, 1).
double ValueNoise(double x, double y) {
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const auto ease = [](double t) { return t * t * (3.0 - 2.0 * t); };
  const double a = ease(x - column);
  const double b = ease(y - row);
  return std::lerp(std::lerp(Hash(column, row), Hash(column + 1, row), a),
                   std::lerp(Hash(column, row + 1), Hash(column + 1, row + 1), a), b);
}

double FloorTexture(const Scene& scene, double x, double y) {
  if (scene.floor_of_boards) return ValueNoise(0.5, 25.0 * y);
  return 0.6 * ValueNoise(12.0 * x, 12.0 * y) + 0.4 * ValueNoise(40.0 * x + 7.0, 40.0 * y);
}

struct Hit {
  double distance = std::numeric_limits<double>::infinity();
  cv::Vec3d bgr{0.0, 0.0, 0.0};
  bool is_ground = false;
};

void HitBox(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& ray, Hit& hit) {
  const Eigen::Vector3d min(box.min.x(), box.min.y(), 0.0);
  const Eigen::Vector3d max(box.max.x(), box.max.y(), box.height_m);
  double enter = 0.0;
  double leave = std::numeric_limits<double>::infinity();
  int face = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(ray(axis)) < 1e-12) {
      if (origin(axis) < min(axis) || origin(axis) > max(axis)) return;
      continue;
    }
    double near = (min(axis) - origin(axis)) / ray(axis);
    double far = (max(axis) - origin(axis)) / ray(axis);
    if (near > far) std::swap(near, far);
    if (near > enter) {
      enter = near;
      face = axis;
    }
    leave = std::min(leave, far);
  }
  if (enter >= leave || enter >= hit.distance) return;
  static constexpr double kShade[] = {1.0, 0.8, 1.2};
  hit = {enter, box.bgr * kShade[face], false};
}

Hit Trace(const Scene& scene, const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
  Hit hit;
  if (ray.z() < 0.0) {
    const double distance = -origin.z() / ray.z();
    const Eigen::Vector3d point = origin + distance * ray;
    const double light = scene.floor_contrast * (FloorTexture(scene, point.x(), point.y()) - 0.5);
    hit = {distance, scene.floor_bgr + cv::Vec3d::all(light), true};
  }
  if (ray.x() > 0.0) {
    const double distance = (scene.wall_x - origin.x()) / ray.x();
    if (distance < hit.distance) hit = {distance, scene.wall_bgr, false};
  }
  for (const Box& box : scene.boxes) HitBox(box, origin, ray, hit);
  return hit;
}

}  // namespace

View Render(const Scene& scene, const GroundCamera& camera, const Pose2& map_from_robot,
            unsigned seed, double pitch_rad, double roll_rad) {
  View view{cv::Mat(camera.height, camera.width, CV_8UC3),
            cv::Mat(camera.height, camera.width, CV_8UC1)};
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, scene.noise);
  const Eigen::Vector3d origin(map_from_robot.x, map_from_robot.y, camera.height_m);
  const double down = camera.tilt_down_rad;
  const Eigen::Matrix3d map_from_body =
      (Eigen::AngleAxisd(map_from_robot.theta, Eigen::Vector3d::UnitZ()) *
       Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      // Four rays a pixel against aliasing; the label is that of the pixel's centre.
      cv::Vec3d sum(0.0, 0.0, 0.0);
      const auto trace = [&](double du, double dv) {
        const double right = (u + du - camera.cx) / camera.fx;
        const double below = (v + dv - camera.cy) / camera.fy;
        const Eigen::Vector3d level(std::cos(down) - below * std::sin(down), -right,
                                    -std::sin(down) - below * std::cos(down));
        return Trace(scene, origin, map_from_body * level);
      };
      for (const double du : {-0.25, 0.25}) {
        for (const double dv : {-0.25, 0.25}) sum += trace(du, dv).bgr * 0.25;
      }
      for (int i = 0; i < 3; ++i) {
        view.bgr.at<cv::Vec3b>(v, u)[i] = cv::saturate_cast<std::uint8_t>(sum[i] + noise(random));
      }
      view.labels.at<std::uint8_t>(v, u) = trace(0.0, 0.0).is_ground ? 1 : 2;
    }
  }
  return view;
}

GroundCamera TestCamera() {
  return GroundCamera::Pinhole(320, 240, 266.0, 0.5, RadiansFromDegrees(22.0));
}

}  // namespace beckon::testing
