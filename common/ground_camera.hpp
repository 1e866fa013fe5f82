// A calibrated camera that looks at the ground: pixels to metres on the floor and back.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "common/config.hpp"

namespace beckon {

// Image: u right, v down, centre of the first pixel (0, 0). Ground: robot frame, x forward, y left,
// m. Ideal pixels are free of lens distortion; where distortion is zero they are the image's own.
struct GroundCamera {
  int width = 0;                                  // pixels
  int height = 0;                                 // pixels
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  // pixels
  double height_m = 0.0;                          // of the optical centre above the ground
  double tilt_down_rad = 0.0;                     // of the optical axis below the horizontal
  std::array<double, 5> distortion{};             // k1 k2 p1 p2 k3 as in OpenCV
  Eigen::Matrix3d ground_from_image =
      Eigen::Matrix3d::Identity();  // ideal pixel (u, v, 1) -> (x, y, 1) m

  // Reads the keys width, height, [camera] and [ground] as in a sequence.toml. Throws ConfigError
  // for a geometry that cannot be (singular homography, ground that is not visible at the bottom of
  // the image).
  static GroundCamera FromConfig(ConfigTable& root);
  // The file may hold other keys besides.
  static GroundCamera Load(const std::filesystem::path& file);
  // The keys that FromConfig() reads, as a file to be written.
  std::string Toml() const;
  // An ideal pinhole camera at (0, 0, height_m), without roll or pan.
  static GroundCamera Pinhole(int width, int height, double focal_px, double height_m,
                              double tilt_down_rad);

  // The same camera delivering pictures of another size.
  GroundCamera Resized(int new_width, int new_height) const;

  // Where the ray through an ideal pixel meets the ground; nothing at or above the horizon.
  std::optional<Eigen::Vector2d> GroundFromPixel(const Eigen::Vector2d& pixel) const;
  // Where a point of the ground appears, in ideal pixels (not limited to the image); nothing for
  // points in or behind the camera's plane.
  std::optional<Eigen::Vector2d> PixelFromGround(const Eigen::Vector2d& point) const;
  // Ideal pixel to the one in the image as taken, and back.
  Eigen::Vector2d Distorted(const Eigen::Vector2d& ideal) const;
  Eigen::Vector2d Undistorted(const Eigen::Vector2d& pixel) const;
  bool has_distortion() const;

  // v of the horizon in ideal pixels at column u (-inf where the camera looks straight down).
  double HorizonRow(double u) const;
};

// The camera on a body that is rotated by pitch (positive: looks further down) about the robot's y
// axis and by roll (positive: turned clockwise as seen from behind) about its x axis, both through
// the optical centre.
GroundCamera Rocked(const GroundCamera& camera, double pitch_rad, double roll_rad);

}  // namespace beckon
