// Motion over the ground from the brightness of all its pixels (direct image alignment, Lucas and
// Kanade 1981), with the three degrees of freedom of the plane. Finds its way by texture too faint
// or too smooth for corners, and to a fraction of a pixel where there are some.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "common/frames.hpp"
#include "common/ground_camera.hpp"

namespace beckon {

// A frame in grey at 1/2, 1/4 and 1/8 of its size, CV_8UC1.
using GreyPyramid = std::vector<cv::Mat>;
GreyPyramid MakePyramid(const cv::Mat& grey);

struct Alignment {
  bool ok = false;  // enough pixels that agree
  Pose2 before_from_now;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of (x, y, theta), m^2, m rad, rad^2
  int pixels = 0;                                        // with texture, at the finest size
};

struct AlignmentOptions {
  float least_gradient = 1.5F;  // grey levels a pixel; less is noise
  int min_pixels = 150;
  double least_signal = 1.6;  // gradients over noise, squared, in the direction that has the least
  double max_range =
      10.0;  // over the camera's height; farther pixels say nothing about translation
  double pixel_correlation = 6.0;  // pixels that err as one, for the covariance
};

// Starts from `predicted`. `from_coarse`: begins at 1/8 size, for predictions that may be far off;
// else at 1/2. `ground`: CV_8UC1 grid over the picture, 255 where ground is expected.
Alignment AlignGround(const GroundCamera& camera, const GreyPyramid& now, const GreyPyramid& before,
                      const cv::Mat& ground, const Pose2& predicted, bool from_coarse,
                      const AlignmentOptions& options);

}  // namespace beckon
