// From a coarse idea of where the ground is to its border in full resolution.
#pragma once

#include <functional>
#include <opencv2/core.hpp>

namespace beckon {

struct BorderOptions {
  int window_px = 24;  // half a side of the neighbourhood that tells what each side looks like
  int reach_px = 14;   // how far the coarse border may be wrong
  // What log-odds of the cells count beside those of a pixel's colour: where both sides look alike,
  // they draw the border.
  float cells_weight = 0.5F;
  float feet_limit = 3.0F;  // log-odds that the feet by motion can say, where both sides look alike
};

// Log-odds as from FootLogOdds, or an empty picture, of half the size: from what is ground about
// there, and where it is asked for; both CV_8UC1.
using FeetFinder = std::function<cv::Mat(const cv::Mat& ground, const cv::Mat& where)>;

// `ground`: CV_8UC1, 255 for ground and 0 for all else, of any smaller size (a grid over the
// picture); `log_odds`: CV_32FC1 of the same size, what it was decided from; `find_feet`:
// may be empty; `bgr`: CV_8UC3.
// Returns the same as `ground` at the size of `bgr`. Each pixel near the border goes to the side
// whose colours just there it fits better (local region statistics as in Lankton and Tannenbaum
// 2008, assigned in a narrow band), first at half resolution and then at full.
cv::Mat RefineBorders(const cv::Mat& bgr, const cv::Mat& ground, const cv::Mat& log_odds,
                      const FeetFinder& find_feet, const BorderOptions& options);

}  // namespace beckon
