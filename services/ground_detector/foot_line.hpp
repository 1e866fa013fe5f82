// Where what stands on the ground meets it, from motion alone: where both sides look alike, colours
// do not tell, and cells are coarse.
#pragma once

#include <opencv2/core.hpp>
#include <span>

#include "common/ground_camera.hpp"
#include "services/ground_detector/motion.hpp"

namespace beckon {

struct FootLineOptions {
  int reach = 16;   // how far the foot may be from where the cells have it, half-size pixels
  int height = 12;  // how much of what stands there is looked at, half-size pixels
  float noise_grey = 2.0F;  // what noise and resampling leave, grey levels
  float edge_px = 0.15F;    // and what the motion errs by, half-size pixels
  float limit = 3.0F;       // what one pixel can say, log-likelihood
  // Log-likelihood of a ground pixel beyond which a motion is too poor to tell feet by.
  float most_of_ground = 1.0F;
  float share = 0.15F;      // of what pixels say, as neighbours err alike
  float smoothness = 0.5F;  // log-likelihood for a row that the foot jumps from line to line
  float jump = 6.0F;        // where one thing stands before another it may jump anywhere
};

// A frame in grey at half its size, CV_8UC1, and where it was taken.
struct PosedGrey {
  const cv::Mat* grey = nullptr;
  BodyPose pose;
};

// Log-odds of ground near the foot of what stands on the ground, CV_32FC1 of the size of `now`; NaN
// elsewhere. `ground`: CV_8UC1 of that size, 255 for ground, where the feet are roughly. `where`:
// the same, zero where no foot is to be looked for. `before`: at most two.
//
// A vertical line of the world and the ground before it make one line in the picture, to the point
// below the camera. On each such line the pixels up to the foot move like the ground, and those
// above as what stands straight on it (plane plus parallax, Irani and Anandan 1996): not at all
// otherwise at the foot, and the more the higher up. The likelihood of each foot is that of all
// pixels around; neighbouring lines agree by dynamic programming (min-marginals).
cv::Mat FootLogOdds(const GroundCamera& camera, const PosedGrey& now,
                    std::span<const PosedGrey> before, const cv::Mat& ground, const cv::Mat& where,
                    const FootLineOptions& options);

}  // namespace beckon
