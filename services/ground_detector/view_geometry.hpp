// What follows from the calibration alone: lens maps, and where in the picture ground can be.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "common/ground_camera.hpp"

namespace beckon {

class ViewGeometry {
 public:
  // `scale`: frame pixels along a side of a cell of the small picture. Throws std::invalid_argument
  // for a camera that does not see the ground.
  ViewGeometry(const GroundCamera& camera, int scale);

  // Takes out lens distortion, and puts it back into labels (undetermined where the ideal picture
  // does not reach).
  cv::Mat IdealFromTaken(const cv::Mat& bgr) const;
  cv::Mat TakenFromIdeal(const cv::Mat& labels) const;

  // The small picture. Its masks are CV_8UC1 of its size, 255 for yes.
  cv::Size cells() const { return cells_; }
  const cv::Mat& above_horizon() const { return above_horizon_; }  // the cell reaches the horizon
  // Above it by no more than a few degrees, where what stands on the ground is seen; higher up are
  // ceilings, sky and bridges, whose colours say little of what stands here.
  const cv::Mat& just_above_horizon() const { return just_above_horizon_; }
  // Directly before the robot: a camera height wide, at the lower border.
  const cv::Mat& near() const { return near_; }
  // Ideal pixel of the frame to cell of the small picture, (u, v, 1), centres at whole numbers.
  const Eigen::Matrix3d& cell_from_pixel() const { return cell_from_pixel_; }

  // CV_8UC1 of the frame's size, in ideal pixels: 255 at and above the horizon.
  const cv::Mat& not_below_horizon() const { return not_below_horizon_; }

 private:
  cv::Size cells_;
  cv::Mat above_horizon_;
  cv::Mat just_above_horizon_;
  cv::Mat near_;
  Eigen::Matrix3d cell_from_pixel_;
  cv::Mat not_below_horizon_;
  // For lenses with distortion, CV_32FC2: where each ideal pixel is in the frame as taken, and the
  // other way round.
  cv::Mat taken_from_ideal_;
  cv::Mat ideal_from_taken_;
};

}  // namespace beckon
