// Spreads what is known at some cells of a picture to the others, along what looks alike.
#pragma once

#include <opencv2/core.hpp>

namespace beckon {

// What single cells say: the value each of them would have by itself, and how much it insists.
struct CellBeliefs {
  cv::Mat weight;  // CV_32FC1, sum of the weights, 0 or more
  cv::Mat sum;     // CV_32FC1, sum of weight times value

  explicit CellBeliefs(const cv::Size& size)
      : weight(size, CV_32FC1, cv::Scalar(0.0)), sum(size, CV_32FC1, cv::Scalar(0.0)) {}
  void Add(int row, int column, float value, float strength) {
    weight.at<float>(row, column) += strength;
    sum.at<float>(row, column) += strength * value;
  }
};

// Random walks with priors (Grady 2005): the field x that minimises
//   sum of weight (x - value)^2 over the cells + sum of w_ij (x_i - x_j)^2 over neighbours,
// w_ij falling from 0.4 to near 0 with the squared difference of their colours. `colours`, `modes`:
// CV_32FC3 as in Segmentation; neighbours are as close as the closer of the two says, so that
// beliefs pass through texture, which modes smooth, and into the soft edge of a shadow, which modes
// break up. `start`: CV_32FC1, a guess from which the solution is sought (the last frame's, for
// instance), or empty. Cells that nothing reaches are 0.
cv::Mat SpreadBeliefs(const CellBeliefs& beliefs, const cv::Mat& colours, const cv::Mat& modes,
                      const cv::Mat& start);

}  // namespace beckon
