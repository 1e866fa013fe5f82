#include "services/ground_detector/overlay.hpp"

#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace beckon {
namespace {

void Tint(cv::Mat& picture, const cv::Mat& mask, const cv::Scalar& colour) {
  cv::Mat tinted;
  cv::addWeighted(picture, 0.7, cv::Mat(picture.size(), CV_8UC3, colour), 0.3, 0.0, tinted);
  tinted.copyTo(picture, mask);
}

}  // namespace

cv::Mat DrawOverlay(const cv::Mat& bgr, const cv::Mat& labels,
                    std::span<const ClassifiedFeature> features) {
  if (bgr.type() != CV_8UC3 || labels.type() != CV_8UC1 || bgr.size() != labels.size()) {
    throw std::invalid_argument("an overlay needs a colour picture and labels of the same size");
  }
  const cv::Scalar green(60, 220, 60);
  const cv::Scalar yellow(0, 220, 255);
  const cv::Scalar red(40, 40, 255);
  cv::Mat picture = bgr.clone();
  Tint(picture, labels == kGround, green);
  Tint(picture, labels == kUndetermined, yellow);
  for (int u = 0; u < labels.cols; ++u) {
    int v = labels.rows - 1;
    while (v >= 0 && labels.at<std::uint8_t>(v, u) == kGround) --v;
    if (v >= 0) picture.at<cv::Vec3b>(v, u) = {40, 40, 255};
  }
  for (const ClassifiedFeature& feature : features) {
    if (!feature.matched) continue;
    const cv::Scalar& colour = feature.feature_class == FeatureClass::kGround      ? green
                               : feature.feature_class == FeatureClass::kNotGround ? red
                                                                                   : yellow;
    cv::circle(picture, feature.pixel, 2, colour, cv::FILLED, cv::LINE_AA);
  }
  return picture;
}

}  // namespace beckon
