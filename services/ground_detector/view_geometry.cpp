#include "services/ground_detector/view_geometry.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/label_runs.hpp"

namespace beckon {
namespace {

constexpr double kJustAboveRad = 0.05;  // 3 degrees

}  // namespace

ViewGeometry::ViewGeometry(const GroundCamera& camera, int scale)
    : cells_(std::max(camera.width / scale, 1), std::max(camera.height / scale, 1)),
      above_horizon_(cells_, CV_8UC1),
      just_above_horizon_(cells_, CV_8UC1),
      near_(cells_, CV_8UC1),
      not_below_horizon_(camera.height, camera.width, CV_8UC1) {
  const auto bottom = camera.GroundFromPixel({camera.cx, camera.height - 1.0});
  if (!bottom) throw std::invalid_argument("the camera does not see the ground");

  const double width = static_cast<double>(camera.width) / cells_.width;
  const double height = static_cast<double>(camera.height) / cells_.height;
  Eigen::Matrix3d pixel_from_cell;
  pixel_from_cell << width, 0.0, 0.5 * width - 0.5, 0.0, height, 0.5 * height - 0.5, 0.0, 0.0, 1.0;
  cell_from_pixel_ = pixel_from_cell.inverse();

  for (int row = 0; row < cells_.height; ++row) {
    for (int column = 0; column < cells_.width; ++column) {
      const Eigen::Vector2d centre =
          (pixel_from_cell * Eigen::Vector3d(column, row, 1.0)).hnormalized();
      const double top = row * height - 0.5;
      const auto point = camera.GroundFromPixel(centre);
      const bool near =
          point && point->x() < 1.4 * bottom->x() && std::abs(point->y()) < 0.5 * camera.height_m;
      const double rise = camera.HorizonRow(centre.x()) - top;
      above_horizon_.at<std::uint8_t>(row, column) = rise >= 0.0 ? 255 : 0;
      const bool just_above = rise >= 0.0 && rise < kJustAboveRad * camera.fy;
      just_above_horizon_.at<std::uint8_t>(row, column) = just_above ? 255 : 0;
      near_.at<std::uint8_t>(row, column) = near ? 255 : 0;
    }
  }
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      not_below_horizon_.at<std::uint8_t>(v, u) = v <= camera.HorizonRow(u) ? 255 : 0;
    }
  }
  if (!camera.has_distortion()) return;
  taken_from_ideal_.create(camera.height, camera.width, CV_32FC2);
  ideal_from_taken_.create(camera.height, camera.width, CV_32FC2);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector2f taken = camera.Distorted({u, v}).cast<float>();
      const Eigen::Vector2f ideal = camera.Undistorted({u, v}).cast<float>();
      taken_from_ideal_.at<cv::Vec2f>(v, u) = {taken.x(), taken.y()};
      ideal_from_taken_.at<cv::Vec2f>(v, u) = {ideal.x(), ideal.y()};
    }
  }
}

cv::Mat ViewGeometry::IdealFromTaken(const cv::Mat& bgr) const {
  if (taken_from_ideal_.empty()) return bgr;
  cv::Mat ideal;
  cv::remap(bgr, ideal, taken_from_ideal_, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return ideal;
}

cv::Mat ViewGeometry::TakenFromIdeal(const cv::Mat& labels) const {
  if (ideal_from_taken_.empty()) return labels;
  cv::Mat taken;
  cv::remap(labels, taken, ideal_from_taken_, {}, cv::INTER_NEAREST, cv::BORDER_CONSTANT,
            cv::Scalar(kUndetermined));
  return taken;
}

}  // namespace beckon
