// Segmentation by mean shift (Comaniciu and Meer 2002) in hue, saturation, intensity and place, on
// a small picture: a tenth of the frame has a hundredth of its pixels, and texture averaged away.
#pragma once

#include <opencv2/core.hpp>

namespace beckon {

// Hue of a pixel that has none: it is set apart from all real hues, which lie in [0, 1).
inline constexpr float kColourlessHue = 2.0F;

// CV_8UC3 (blue, green, red) to CV_32FC3 (hue, saturation, intensity), each in [0, 1] but for the
// hue of pixels whose saturation or intensity is below 0.1: noise alone decides that hue, so it is
// kColourlessHue.
cv::Mat HsiFromBgr(const cv::Mat& bgr);

struct MeanShiftOptions {
  int space_cells = 5;           // radius of the kernel in the picture
  float hue = 0.06F;             // radius in hue, as a share of the circle
  float saturation = 0.10F;      // radius in saturation
  float intensity_min = 0.045F;  // radius in intensity for a smooth picture; grows with
  float intensity_max = 0.14F;   // what texture is left, up to this
  float texture_gain = 3.0F;     // radius in intensity over the median step from cell to cell
  int iterations = 6;
  int min_cells = 3;  // smaller segments join the neighbour that is most like them
};

struct Segmentation {
  cv::Mat ids;  // CV_32SC1, 0 to count - 1; each segment is 4-connected
  int count = 0;
};

// `hsi`: as from HsiFromBgr.
Segmentation MeanShiftSegments(const cv::Mat& hsi, const MeanShiftOptions& options);

}  // namespace beckon
