// From log-odds of cells to a label for each pixel.
#pragma once

#include <opencv2/core.hpp>

#include "services/ground_detector/borders.hpp"

namespace beckon {

// Log-odds of ground up to here, a probability from 1/3 to 2/3, decide nothing.
inline constexpr float kUnsureLogOdds = 0.7F;

// Which cells are ground (255) and which are undetermined (255 in `unsure`): those without clear
// log-odds over some area, and those whose log-odds are nowhere near them clear. Between ground and
// not, the log-odds pass through 0 as well, but there the border decides. `log_odds`: CV_32FC1.
cv::Mat DecideCells(const cv::Mat& log_odds, cv::Mat& unsure);

// GroundLabel of each pixel of `ideal` (CV_8UC3), CV_8UC1, from the cells decided. `find_feet`:
// may be empty. `refine`: the borders follow the picture; else they are those of the
// cells.
cv::Mat LabelPixels(const cv::Mat& ideal, const cv::Mat& log_odds, const FeetFinder& find_feet,
                    bool refine, const BorderOptions& options);

}  // namespace beckon
