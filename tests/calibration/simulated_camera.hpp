// A camera over a floor, known to the last digit, that takes pictures of boards.
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <vector>

#include "tools/calibration/mount.hpp"

namespace beckon::testing {

struct SimulatedCamera {
  cv::Size size{640, 480};
  Lens lens{520.0, 523.0, 327.0, 233.0, {-0.22, 0.07, 0.001, -0.0008, 0.0}, 0.0};
  double height_m = 0.55;
  double tilt_down_rad = 0.45;
  double pan_rad = 0.03;
  double roll_rad = -0.015;

  Eigen::Isometry3d CameraFromFloor() const;
  // The pixel, as taken, of a point given in the camera's frame.
  Eigen::Vector2d PixelOf(const Eigen::Vector3d& in_camera) const;
  Eigen::Vector2d PixelOfFloor(const Eigen::Vector2d& floor_m) const;
  // The same camera as the services know it.
  GroundCamera Truth() const;

  // A picture (CV_8UC3, noisy) of boards. Each pose takes (x, y, 0) of the printed page, from its
  // first inner corner, y down, to the camera's frame.
  cv::Mat Take(const Board& board, const std::vector<Eigen::Isometry3d>& camera_from_board) const;
  // A board on the floor: its first inner corner and the direction of its rows.
  Eigen::Isometry3d OnFloor(const Eigen::Vector2d& first_m, double direction_rad) const;
};

// Boards held before the camera at angles as a person would hold them.
std::vector<Eigen::Isometry3d> HeldBoards(const Board& board, int count);

}  // namespace beckon::testing
