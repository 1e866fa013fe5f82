#include "services/ground_detector/random_walk.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr int kSweeps = 60;
constexpr float kOverRelaxation = 1.7F;
constexpr float kStrongestLink = 0.4F;  // between cells of the same colour
constexpr float kLeastLink = 0.001F;    // between cells of quite different colours
constexpr float kIgnorance = 0.002F;    // pull of every cell to 0

float SquaredDifference(const cv::Mat& colours, const cv::Point& a, const cv::Point& b) {
  const cv::Vec3f difference = colours.at<cv::Vec3f>(a) - colours.at<cv::Vec3f>(b);
  return difference.dot(difference);
}

}  // namespace

cv::Mat SpreadBeliefs(const CellBeliefs& beliefs, const cv::Mat& colours, const cv::Mat& modes,
                      const cv::Mat& start) {
  CV_Assert(colours.type() == CV_32FC3 && beliefs.weight.size() == colours.size());
  const int rows = colours.rows;
  const int columns = colours.cols;
  // Links to the right and downwards; zero at the far ends.
  cv::Mat right(colours.size(), CV_32FC1, cv::Scalar(0.0));
  cv::Mat down(colours.size(), CV_32FC1, cv::Scalar(0.0));
  const auto link = [&](const cv::Point& a, const cv::Point& b) {
    const float difference =
        std::min(SquaredDifference(colours, a, b), SquaredDifference(modes, a, b));
    return kStrongestLink * std::exp(-2.0F * difference) + kLeastLink;
  };
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < columns; ++u) {
      if (u + 1 < columns) right.at<float>(v, u) = link({u, v}, {u + 1, v});
      if (v + 1 < rows) down.at<float>(v, u) = link({u, v}, {u, v + 1});
    }
  }
  cv::Mat field =
      start.empty() ? cv::Mat(colours.size(), CV_32FC1, cv::Scalar(0.0)) : start.clone();
  // Gauss-Seidel with over-relaxation, forwards and backwards in turn.
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const bool forwards = sweep % 2 == 0;
    for (int i = 0; i < rows * columns; ++i) {
      const int index = forwards ? i : rows * columns - 1 - i;
      const int v = index / columns;
      const int u = index % columns;
      float weight = beliefs.weight.at<float>(v, u) + kIgnorance;
      float sum = beliefs.sum.at<float>(v, u);
      const auto pull = [&](float strength, float value) {
        weight += strength;
        sum += strength * value;
      };
      if (u > 0) pull(right.at<float>(v, u - 1), field.at<float>(v, u - 1));
      if (u + 1 < columns) pull(right.at<float>(v, u), field.at<float>(v, u + 1));
      if (v > 0) pull(down.at<float>(v - 1, u), field.at<float>(v - 1, u));
      if (v + 1 < rows) pull(down.at<float>(v, u), field.at<float>(v + 1, u));
      float& value = field.at<float>(v, u);
      value += kOverRelaxation * (sum / weight - value);
    }
  }
  return field;
}

}  // namespace beckon
