// Motion over the ground from the brightness of what is known to be ground (direct image alignment,
// Lucas and Kanade 1981; inverse compositional, Baker and Matthews 2004). Finds its way by texture
// too faint or too smooth for corners, by the foot lines of walls and things, and to a fraction of
// a pixel where there is more.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/ground_camera.hpp"
#include "services/ground_detector/motion.hpp"

namespace beckon {

// A frame in grey at 1/2, 1/4 and 1/8 of its size, CV_8UC1.
using GreyPyramid = std::vector<cv::Mat>;
GreyPyramid MakePyramid(const cv::Mat& grey);

// A pixel of the ground that shows some gradient.
struct GroundSample {
  Eigen::Vector2d point;           // m, robot frame
  Eigen::Vector2d gradient;        // grey levels a pixel of its level
  Eigen::Matrix2d noise_shape;     // covariance of the gradient for noise of unit variance
  Eigen::Matrix2d pixel_by_point;  // pixels of its level, per m
  double grey = 0.0;
  int patch = 0;  // pixels of one patch move together, or not
};
// For each level of a pyramid.
using GroundTexture = std::vector<std::vector<GroundSample>>;

struct AlignmentOptions {
  double least_gradient = 1.5;  // grey levels a pixel; less is noise
  int cell_px = 6;              // of each cell of this side only the pixel with the most gradient
  double max_range = 10.0;      // over the camera's height; texture farther away says little
  double max_foot_range = 24.0;
  int min_samples = 60;            // that are seen again
  double edge_px = 0.05;           // what sampling makes of sharp edges: error over gradient
  double correlated_pixels = 6.0;  // that err as one, for the covariance
};

// What there is to align with later: ground, a little away from its borders, and the foot lines of
// what stands on it, which are ground as well. `camera`: as it leans in this frame; `labels`:
// GroundLabel of each pixel, CV_8UC1 at the full size.
GroundTexture TakeGroundTexture(const GroundCamera& camera, const GreyPyramid& pyramid,
                                const cv::Mat& labels, const AlignmentOptions& options);

// An earlier frame to align with.
struct AlignmentReference {
  const GroundTexture* texture = nullptr;
  Pose2 frame_from_robot;
};

struct Alignment {
  bool ok = false;  // enough of the ground was seen again
  BodyPose pose;
  Matrix5d covariance = Matrix5d::Zero();  // with what the prior knows
  int samples = 0;
  double cost = 0.0;  // mean of truncated squares, for comparison of starts
};

// Starts from `start`, at 1/8 size if `from_coarse`, else at 1/2. At most two references.
Alignment AlignGround(const GroundCamera& camera, const GreyPyramid& now,
                      std::span<const AlignmentReference> references, const BodyPose& start,
                      const MotionPrior& prior, bool from_coarse, const AlignmentOptions& options);

}  // namespace beckon
