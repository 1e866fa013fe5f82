#include "common/ground_camera.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "common/frames.hpp"

namespace beckon {
namespace {

// +1 or -1: the sign of the homogeneous coordinate of pixels that see the ground. The bottom of the
// image does, or the camera is of no use.
double GroundSign(const GroundCamera& camera) {
  const Eigen::Vector3d bottom(camera.cx, camera.height - 1, 1.0);
  return camera.ground_from_image.row(2).dot(bottom) >= 0.0 ? 1.0 : -1.0;
}

cv::Matx33d CameraMatrix(const GroundCamera& camera) {
  return {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
}

}  // namespace

GroundCamera GroundCamera::FromConfig(ConfigTable& root) {
  GroundCamera camera;
  root.Required("width", camera.width, Range{16, 16384});
  root.Required("height", camera.height, Range{16, 16384});

  ConfigTable& table = root.Table("camera");
  table.Required("fx", camera.fx, AtLeast(1.0));
  table.Required("fy", camera.fy, AtLeast(1.0));
  table.Required("cx", camera.cx);
  table.Required("cy", camera.cy);
  table.Required("height_m", camera.height_m, Range{0.01, 100.0});
  double tilt_down_deg = 0.0;
  table.Required("tilt_down_deg", tilt_down_deg, Range{-45.0, 90.0});
  camera.tilt_down_rad = RadiansFromDegrees(tilt_down_deg);
  std::vector<double> distortion(5, 0.0);
  table.Optional("distortion", distortion, 5);
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());

  ConfigTable& ground = root.Table("ground");
  std::vector<double> h;
  ground.Required("image_to_ground", h, std::size_t{9});
  camera.ground_from_image << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  const double scale = camera.ground_from_image.cwiseAbs().maxCoeff();
  if (!(scale > 0.0) ||
      Eigen::FullPivLU<Eigen::Matrix3d>(camera.ground_from_image / scale).rank() < 3) {
    ground.Fail("image_to_ground", "is singular: it does not map the image to a plane");
  }
  const auto bottom = camera.GroundFromPixel({camera.cx, camera.height - 1.0});
  if (!bottom || bottom->x() <= 0.0) {
    ground.Fail("image_to_ground",
                "the bottom of the image has to show ground in front of the camera");
  }
  return camera;
}

GroundCamera GroundCamera::Load(const std::filesystem::path& file) {
  ConfigFile config(file);
  return FromConfig(config.root());
}

std::string GroundCamera::Toml() const {
  char text[1024];
  const auto& k = distortion;
  const auto& h = ground_from_image;
  std::snprintf(text, sizeof(text),
                "width = %d\nheight = %d\n\n"
                "[camera]\nfx = %.6f\nfy = %.6f\ncx = %.3f\ncy = %.3f\nheight_m = %.4f\n"
                "tilt_down_deg = %.4f\ndistortion = [%.8f, %.8f, %.8f, %.8f, %.8f]\n\n"
                "[ground]\n# image (u, v, 1) in pixels, free of distortion -> robot ground plane "
                "(x forward, y left, 1) in metres\n"
                "image_to_ground = [%.12e, %.12e, %.12e, %.12e, %.12e, %.12e, %.12e, %.12e, "
                "%.12e]\n",
                width, height, fx, fy, cx, cy, height_m, DegreesFromRadians(tilt_down_rad), k[0],
                k[1], k[2], k[3], k[4], h(0, 0), h(0, 1), h(0, 2), h(1, 0), h(1, 1), h(1, 2),
                h(2, 0), h(2, 1), h(2, 2));
  return text;
}

GroundCamera GroundCamera::Pinhole(int width, int height, double focal_px, double height_m,
                                   double tilt_down_rad) {
  GroundCamera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = focal_px;
  camera.cx = (width - 1) / 2.0;
  camera.cy = (height - 1) / 2.0;
  camera.height_m = height_m;
  camera.tilt_down_rad = tilt_down_rad;
  // Columns: where robot x, robot y and the point below the camera appear. Camera axes: x right, y
  // down, z forward.
  const double c = std::cos(tilt_down_rad);
  const double s = std::sin(tilt_down_rad);
  Eigen::Matrix3d camera_from_ground;
  camera_from_ground << 0.0, -1.0, 0.0, -s, 0.0, height_m * c, c, 0.0, height_m * s;
  Eigen::Matrix3d intrinsics;
  intrinsics << focal_px, 0.0, camera.cx, 0.0, focal_px, camera.cy, 0.0, 0.0, 1.0;
  camera.ground_from_image = (intrinsics * camera_from_ground).inverse();
  // Scaled so that pixels that see the ground have a positive homogeneous coordinate.
  camera.ground_from_image *= GroundSign(camera) / camera.ground_from_image.cwiseAbs().maxCoeff();
  return camera;
}

GroundCamera GroundCamera::Resized(int new_width, int new_height) const {
  GroundCamera resized = *this;
  const double sx = static_cast<double>(new_width) / width;
  const double sy = static_cast<double>(new_height) / height;
  resized.width = new_width;
  resized.height = new_height;
  resized.fx = fx * sx;
  resized.fy = fy * sy;
  // Pixel centres are at whole numbers, so that the border of the image is at -0.5.
  resized.cx = (cx + 0.5) * sx - 0.5;
  resized.cy = (cy + 0.5) * sy - 0.5;
  Eigen::Matrix3d old_from_new;
  old_from_new << 1.0 / sx, 0.0, 0.5 / sx - 0.5, 0.0, 1.0 / sy, 0.5 / sy - 0.5, 0.0, 0.0, 1.0;
  resized.ground_from_image = ground_from_image * old_from_new;
  return resized;
}

std::optional<Eigen::Vector2d> GroundCamera::GroundFromPixel(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector3d ground = ground_from_image * pixel.homogeneous();
  if (GroundSign(*this) * ground.z() <= 1e-12 * ground_from_image.cwiseAbs().maxCoeff())
    return std::nullopt;
  return ground.hnormalized();
}

std::optional<Eigen::Vector2d> GroundCamera::PixelFromGround(const Eigen::Vector2d& point) const {
  const Eigen::Matrix3d image_from_ground = ground_from_image.inverse();
  const Eigen::Vector3d pixel = image_from_ground * point.homogeneous();
  // The inverse of the homogeneous coordinate is the depth, of the same sign as that of a visible
  // point.
  const Eigen::Vector3d reference =
      image_from_ground * (*GroundFromPixel({cx, height - 1.0})).homogeneous();
  if (pixel.z() * reference.z() <= 0.0) return std::nullopt;
  return pixel.hnormalized();
}

bool GroundCamera::has_distortion() const {
  for (const double coefficient : distortion) {
    if (coefficient != 0.0) return true;
  }
  return false;
}

Eigen::Vector2d GroundCamera::Distorted(const Eigen::Vector2d& ideal) const {
  if (!has_distortion()) return ideal;
  const double x = (ideal.x() - cx) / fx;
  const double y = (ideal.y() - cy) / fy;
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {fx * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + cx,
          fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + cy};
}

Eigen::Vector2d GroundCamera::Undistorted(const Eigen::Vector2d& pixel) const {
  if (!has_distortion()) return pixel;
  const std::vector<cv::Point2d> in = {{pixel.x(), pixel.y()}};
  std::vector<cv::Point2d> out;
  const std::vector<double> coefficients(distortion.begin(), distortion.end());
  cv::undistortPoints(in, out, CameraMatrix(*this), coefficients, cv::noArray(),
                      CameraMatrix(*this),
                      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-9));
  return {out[0].x, out[0].y};
}

double GroundCamera::HorizonRow(double u) const {
  // Homogeneous coordinate zero: h20 u + h21 v + h22 = 0.
  const Eigen::RowVector3d h = ground_from_image.row(2);
  if (std::abs(h(1)) < 1e-15 * ground_from_image.cwiseAbs().maxCoeff()) {
    return -std::numeric_limits<double>::infinity();
  }
  return -(h(0) * u + h(2)) / h(1);
}

GroundCamera Rocked(const GroundCamera& camera, double pitch_rad, double roll_rad) {
  // Robot x in camera axes (x right, y down, z forward); robot y is minus the camera's x axis.
  const Eigen::Vector3d forward(0.0, -std::sin(camera.tilt_down_rad),
                                std::cos(camera.tilt_down_rad));
  const Eigen::Matrix3d calibrated_from_rocked =
      (Eigen::AngleAxisd(roll_rad, forward) *
       Eigen::AngleAxisd(-pitch_rad, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  Eigen::Matrix3d intrinsics;
  intrinsics << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  GroundCamera rocked = camera;
  rocked.tilt_down_rad += pitch_rad;
  rocked.ground_from_image =
      camera.ground_from_image * intrinsics * calibrated_from_rocked * intrinsics.inverse();
  return rocked;
}

}  // namespace beckon
