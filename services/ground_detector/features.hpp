// Points that can be found again in the next frames: FAST corners (Rosten and Drummond 2006) spread
// over the picture, described by upright SURF (Bay et al. 2008) at one fixed scale. Upright,
// because a camera on a robot does not roll; at one scale, because a frame differs little from the
// ones just before it.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace beckon {

// Unit vector: per cell of a 4 x 4 grid the sums of dx, dy, |dx|, |dy|.
using SurfDescriptor = std::array<float, 64>;

struct Feature {
  cv::Point2f pixel;      // u right, v down, centre of the first pixel (0, 0)
  float strength = 0.0F;  // FAST score
  SurfDescriptor descriptor{};
};

struct FeatureOptions {
  int fast_threshold = 8;  // grey levels; low, so that plain floors have features too
  // Corners on straight edges are none: smaller over greater eigenvalue of the structure tensor.
  float least_cornerness = 0.07F;
  int cell_px = 32;  // side of a grid cell
  int per_cell = 2;  // strongest corners kept in each cell
};

// Distance of a feature from the border of the picture that the descriptor needs, pixels.
inline constexpr int kFeatureBorderPx = 23;

// `grey`: CV_8UC1. Ordered by grid cell.
std::vector<Feature> DetectFeatures(const cv::Mat& grey, const FeatureOptions& options);

// `integral`: CV_32SC1, one larger than the picture (cv::integral). The same as dlib's
// compute_surf_descriptor(image, point, 2.0, 0.0), some ten times as fast as the window never
// turns.
SurfDescriptor UprightSurf(const cv::Mat& integral, int u, int v);

// Squared Euclidean distance, 0 (equal) to 4.
float DescriptorDistance(const SurfDescriptor& a, const SurfDescriptor& b);

}  // namespace beckon
