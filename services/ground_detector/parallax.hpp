// What the motion between two frames says about each part of the picture: does it move like the
// ground, or like something that rises from it?
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/ground_camera.hpp"
#include "services/ground_detector/motion.hpp"

namespace beckon {

struct ParallaxOptions {
  // The alternatives to ground: planes at these shares of the camera's height.
  std::vector<double> height_ratios = {0.12, 0.25, 0.42, 0.62, 0.8};
  // Reflections in a shiny floor move like planes below it, and so does the floor at the bottom of
  // a step: such a place does not stand up, and is not proven to be ground.
  std::vector<double> reflection_ratios = {-0.6, -2.0, -8.0};
  float noise_grey = 0.4F;  // mean absolute difference that noise and resampling leave, grey levels
};

// Evidence for each cell of a grid over the picture, CV_32FC1 of `cells`: 1 = moves like the ground
// and not otherwise, -1 = moves like one of the alternatives and not like
// the ground, 0 = cannot be told (no texture, no parallax, not seen before, or at or above the
// horizon). `now`, `before`: CV_8UC1 at half the size of `camera`'s pictures. Sums of absolute
// differences under both hypotheses, over the cell's own texture, so that a plain floor and a plain
// wall are both 0.
cv::Mat GroundEvidence(const GroundCamera& camera, const cv::Mat& now, const cv::Mat& before,
                       const BodyPose& now_pose, const BodyPose& before_pose, const cv::Size& cells,
                       const ParallaxOptions& options);

}  // namespace beckon
