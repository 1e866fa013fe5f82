#include "services/ground_detector/labels.hpp"

#include <opencv2/imgproc.hpp>
#include <vector>

#include "common/label_runs.hpp"

namespace beckon {
namespace {

constexpr float kClear = 1.0F;  // log-odds that some cell of a region has to reach

}  // namespace

cv::Mat DecideCells(const cv::Mat& log_odds, cv::Mat& unsure) {
  unsure = cv::abs(log_odds) <= kUnsureLogOdds;
  cv::morphologyEx(unsure, unsure, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8UC1));
  cv::Mat ground = log_odds > 0.0F;
  ground.setTo(0, unsure);
  for (const float sign : {1.0F, -1.0F}) {
    const cv::Mat side = sign > 0.0F ? ground.clone() : cv::Mat(~ground & ~unsure);
    cv::Mat components;
    const int count = cv::connectedComponents(side, components, 4);
    std::vector<bool> clear(static_cast<std::size_t>(count), false);
    for (int v = 0; v < side.rows; ++v) {
      for (int u = 0; u < side.cols; ++u) {
        if (sign * log_odds.at<float>(v, u) > kClear) {
          clear[static_cast<std::size_t>(components.at<int>(v, u))] = true;
        }
      }
    }
    for (int v = 0; v < side.rows; ++v) {
      for (int u = 0; u < side.cols; ++u) {
        const int component = components.at<int>(v, u);
        if (component == 0 || clear[static_cast<std::size_t>(component)]) continue;
        unsure.at<std::uint8_t>(v, u) = 255;
        ground.at<std::uint8_t>(v, u) = 0;
      }
    }
  }
  return ground;
}

cv::Mat LabelPixels(const cv::Mat& ideal, const cv::Mat& log_odds, const FeetFinder& find_feet,
                    bool refine, const BorderOptions& options) {
  cv::Mat unsure;
  cv::Mat ground = DecideCells(log_odds, unsure);
  cv::resize(unsure, unsure, ideal.size(), 0.0, 0.0, cv::INTER_NEAREST);
  if (refine) {
    ground = RefineBorders(ideal, ground, log_odds, find_feet, options);
  } else {
    // The border runs where log-odds between the cells' centres are even.
    cv::Mat even;
    cv::resize(log_odds, even, ideal.size(), 0.0, 0.0, cv::INTER_LINEAR);
    ground = (even > 0.0F) & ~unsure;
  }
  cv::Mat labels(ideal.size(), CV_8UC1, cv::Scalar(kNotGround));
  labels.setTo(kUndetermined, unsure);
  labels.setTo(kGround, ground);
  return labels;
}

}  // namespace beckon
