// Focal lengths, centre and distortion of a camera, from pictures of a board held at many angles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "tools/calibration/board.hpp"

namespace beckon {

struct Lens {
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  // pixels
  std::array<double, 5> distortion{};             // k1 k2 p1 p2 k3 as in OpenCV
  double rms_px = 0.0;                            // reprojection error of the pictures it is from

  // Pixel as taken to the one that a lens without distortion would have shown.
  Eigen::Vector2d Undistorted(const Eigen::Vector2d& pixel) const;
};

// OpenCV's calibrateCamera (Zhang's method). k3 stays 0: a third radial term is not to be had from
// a few pictures, and runs wild in the corners. Throws CalibrationError where there are fewer than
// kLeastLensPictures, or where they leave the focal length uncertain, as pictures do that show the
// board from the same side again and again.
Lens CalibrateLens(const std::vector<std::vector<BoardCorner>>& pictures, const cv::Size& size);

inline constexpr std::size_t kLeastLensPictures = 5;

}  // namespace beckon
