#include "tests/calibration/simulated_camera.hpp"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace beckon::testing {

Eigen::Isometry3d SimulatedCamera::CameraFromFloor() const {
  // Camera axes: x right, y down, z forward; without turns it looks along robot x.
  Eigen::Matrix3d level;
  level << 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0;
  const Eigen::Matrix3d body = (Eigen::AngleAxisd(pan_rad, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(tilt_down_rad, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  Eigen::Isometry3d camera_from_floor = Eigen::Isometry3d::Identity();
  camera_from_floor.linear() = level * body.transpose();
  camera_from_floor.translation() =
      -camera_from_floor.linear() * Eigen::Vector3d(0.0, 0.0, height_m);
  return camera_from_floor;
}

Eigen::Vector2d SimulatedCamera::PixelOf(const Eigen::Vector3d& in_camera) const {
  GroundCamera optics;
  optics.fx = lens.fx;
  optics.fy = lens.fy;
  optics.cx = lens.cx;
  optics.cy = lens.cy;
  optics.distortion = lens.distortion;
  return optics.Distorted({lens.fx * in_camera.x() / in_camera.z() + lens.cx,
                           lens.fy * in_camera.y() / in_camera.z() + lens.cy});
}

Eigen::Vector2d SimulatedCamera::PixelOfFloor(const Eigen::Vector2d& floor_m) const {
  return PixelOf(CameraFromFloor() * Eigen::Vector3d(floor_m.x(), floor_m.y(), 0.0));
}

GroundCamera SimulatedCamera::Truth() const {
  GroundCamera camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.fx = lens.fx;
  camera.fy = lens.fy;
  camera.cx = lens.cx;
  camera.cy = lens.cy;
  camera.distortion = lens.distortion;
  camera.height_m = height_m;
  camera.tilt_down_rad = tilt_down_rad;
  Eigen::Matrix3d matrix;
  matrix << lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0;
  Eigen::Matrix3d columns;
  const Eigen::Isometry3d pose = CameraFromFloor();
  columns << pose.linear().leftCols<2>(), pose.translation();
  camera.ground_from_image = (matrix * columns).inverse();
  return camera;
}

Eigen::Isometry3d SimulatedCamera::OnFloor(const Eigen::Vector2d& first_m,
                                           double direction_rad) const {
  Eigen::Isometry3d floor_from_board = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d along(std::cos(direction_rad), std::sin(direction_rad), 0.0);
  const Eigen::Vector3d down(along.y(), -along.x(), 0.0);
  floor_from_board.linear() << along, down, along.cross(down);
  floor_from_board.translation() << first_m, 0.0;
  return CameraFromFloor() * floor_from_board;
}

cv::Mat SimulatedCamera::Take(const Board& board,
                              const std::vector<Eigen::Isometry3d>& camera_from_board) const {
  constexpr int kSquarePx = 40;
  constexpr double kFine = 3.0;  // pixels of the ideal picture to one of the camera's
  const cv::Mat page = DrawBoard(board, kSquarePx) * 0.8 + 20.0;
  // The ideal picture has a margin, into which barrel distortion looks.
  const double margin = 0.25 * size.width;
  const cv::Size fine_size(cvRound(kFine * (size.width + 2.0 * margin)),
                           cvRound(kFine * (size.height + 2.0 * margin)));
  cv::Mat fine(fine_size, CV_8UC1, cv::Scalar(120));
  for (const Eigen::Isometry3d& pose : camera_from_board) {
    // Page pixel -> board, whose first inner corner is two squares into the page -> ideal picture.
    const double metre = board.square_m / kSquarePx;
    Eigen::Matrix3d board_from_page;
    board_from_page << metre, 0.0, 0.5 * metre - 2.0 * board.square_m, 0.0, metre,
        0.5 * metre - 2.0 * board.square_m, 0.0, 0.0, 1.0;
    Eigen::Matrix3d columns;
    columns << pose.linear().leftCols<2>(), pose.translation();
    Eigen::Matrix3d fine_from_camera;
    const double shift = kFine * (margin + 0.5) - 0.5;
    fine_from_camera << kFine * lens.fx, 0.0, kFine * lens.cx + shift, 0.0, kFine * lens.fy,
        kFine * lens.cy + shift, 0.0, 0.0, 1.0;
    const Eigen::Matrix3d h = fine_from_camera * columns * board_from_page;
    const cv::Matx33d warp(h(0, 0), h(0, 1), h(0, 2), h(1, 0), h(1, 1), h(1, 2), h(2, 0), h(2, 1),
                           h(2, 2));
    cv::warpPerspective(page, fine, warp, fine_size, cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
  }
  cv::blur(fine, fine, {3, 3});

  std::vector<cv::Point2f> taken;
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u)
      taken.emplace_back(static_cast<float>(u), static_cast<float>(v));
  }
  const cv::Matx33d matrix(lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0);
  const std::vector<double> coefficients(lens.distortion.begin(), lens.distortion.end());
  cv::Mat ideal;
  cv::undistortPoints(taken, ideal, matrix, coefficients, cv::noArray(), matrix);
  ideal = ideal.reshape(2, size.height);
  ideal = ideal * kFine + cv::Scalar::all(kFine * (margin + 0.5) - 0.5);
  cv::Mat grey;
  cv::remap(fine, grey, ideal, {}, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(120));
  cv::Mat noise(size, CV_16SC1);
  cv::RNG(7).fill(noise, cv::RNG::NORMAL, 0.0, 1.5);
  cv::add(grey, noise, grey, cv::noArray(), CV_8U);
  cv::Mat picture;
  cv::cvtColor(grey, picture, cv::COLOR_GRAY2BGR);
  return picture;
}

std::vector<Eigen::Isometry3d> HeldBoards(const Board& board, int count) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) {
    const double turn = 2.4 * i;
    const Eigen::Vector3d axis(std::cos(turn), std::sin(turn), 0.0);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = Eigen::AngleAxisd(0.5 + 0.03 * (i % 3), axis).toRotationMatrix();
    const Eigen::Vector3d middle(0.06 * std::cos(1.7 * i), 0.045 * std::sin(1.7 * i),
                                 0.42 + 0.03 * (i % 4));
    const Eigen::Vector2d half = 0.5 * board.extent();
    pose.translation() = middle - pose.linear() * Eigen::Vector3d(half.x(), half.y(), 0.0);
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace beckon::testing
