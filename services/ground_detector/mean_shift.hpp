// Segmentation by mean shift (Comaniciu and Meer 2002) in hue, saturation, intensity and place, on
// a small picture: a tenth of the frame has a hundredth of its pixels, and texture averaged away.
#pragma once

#include <opencv2/core.hpp>

namespace beckon {

// Hue of a pixel that has none: it is set apart from all real hues, which lie in [0, 1).
inline constexpr float kColourlessHue = 2.0F;

// CV_8UC3 (blue, green, red) to CV_32FC3 (hue, saturation, intensity), each in [0, 1] but for the
// hue of pixels whose saturation is below `colourless_saturation` or whose intensity is below 0.1:
// noise alone decides that hue, so it is kColourlessHue. 0.1 suits single pixels; a mean over 10 x
// 10 of them has a tenth of their noise, and pale walls and floors often differ in nothing but a
// trace of hue.
cv::Mat HsiFromBgr(const cv::Mat& bgr, float colourless_saturation = 0.1F);

// Radii of the kernel: each starts at `min`, for a smooth picture, and grows with the frequency
// content of the picture, measured as the median step from cell to cell, up to `max`.
struct Bandwidth {
  float min;
  float max;
  float gain;  // radius over the median step
};

struct MeanShiftOptions {
  float colourless_saturation = 0.01F;
  int space_cells = 5;  // in the picture
  Bandwidth intensity{0.035F, 0.14F, 3.0F};
  Bandwidth chroma{0.022F, 0.10F, 3.0F};  // in the plane of saturation (radius) and hue (angle)
  int iterations = 6;
  int min_cells = 3;  // smaller segments join the neighbour that is most like them
};

struct Segmentation {
  cv::Mat ids;  // CV_32SC1, 0 to count - 1; each segment is 4-connected
  int count = 0;
  // CV_32FC3 in units of the kernel's radii: the colour of each cell, and of the mode that it
  // belongs to.
  cv::Mat colours;
  cv::Mat modes;
};

// `hsi`: as from HsiFromBgr.
Segmentation MeanShiftSegments(const cv::Mat& hsi, const MeanShiftOptions& options);

// The segments in full resolution, CV_32SC1 of the size of `bgr` (CV_8UC3): a pixel of a cell that
// borders on another segment goes to that segment, of those in the nine cells around it, whose
// colour there is most like its own.
cv::Mat RefineSegments(const cv::Mat& bgr, const Segmentation& segmentation);

}  // namespace beckon
