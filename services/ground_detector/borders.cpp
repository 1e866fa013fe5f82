#include "services/ground_detector/borders.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace beckon {
namespace {

constexpr float kLeastVariance = 9.0F;  // sensor noise, grey levels squared
constexpr float kLimit = 4.0F;          // log-ratio that one pixel can say
constexpr float kLeastShare = 0.01F;    // of the window that a side needs to be described

// Intensity and two opponent colours, CV_32FC3: less correlated than blue, green and red.
cv::Mat Opponent(const cv::Mat& bgr) {
  static const cv::Matx33f matrix(1.0F / 3, 1.0F / 3, 1.0F / 3,  //
                                  0.0F, -0.7F, 0.7F,             //
                                  -0.8F, 0.4F, 0.4F);
  cv::Mat opponent;
  bgr.convertTo(opponent, CV_32F);
  cv::transform(opponent, opponent, matrix);
  return opponent;
}

// Mean and variance of the colours around each pixel, of the pixels in a mask.
struct LocalColours {
  cv::Mat mean;      // CV_32FC3
  cv::Mat variance;  // CV_32FC3
  cv::Mat share;     // CV_32FC1, of the window that is in the mask
};

LocalColours Describe(const cv::Mat& colours, const cv::Mat& squares, const cv::Mat& mask,
                      int window) {
  const cv::Size size(2 * window + 1, 2 * window + 1);
  LocalColours local;
  cv::Mat masked(colours.size(), CV_32FC3, cv::Scalar::all(0.0));
  colours.copyTo(masked, mask);
  cv::boxFilter(masked, local.mean, CV_32F, size);
  masked.setTo(cv::Scalar::all(0.0));
  squares.copyTo(masked, mask);
  cv::boxFilter(masked, local.variance, CV_32F, size);
  cv::Mat one;
  mask.convertTo(one, CV_32F, 1.0 / 255.0);
  cv::boxFilter(one, local.share, CV_32F, size);
  return local;
}

// Log-likelihood of a colour, without constants.
float LogLikelihood(const cv::Vec3f& colour, const LocalColours& local, int row, int column) {
  const float scale = 1.0F / local.share.at<float>(row, column);
  const auto& sum = local.mean.at<cv::Vec3f>(row, column);
  const auto& squares = local.variance.at<cv::Vec3f>(row, column);
  float value = 0.0F;
  for (int i = 0; i < 3; ++i) {
    const float mean = scale * sum[i];
    const float variance = std::max(scale * squares[i] - mean * mean, 0.0F) + kLeastVariance;
    const float difference = colour[i] - mean;
    value -= 0.5F * (difference * difference / variance + std::log(variance));
  }
  return value;
}

cv::Mat Disc(int radius) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * radius + 1, 2 * radius + 1));
}

// One pass: the pixels within `reach` of the border are assigned anew, from the colours of what is
// more than `doubt` away from it.
void Reassign(const cv::Mat& colours, const LocalColours& ground, const LocalColours& other,
              int pixels_per_local, int reach, int smoothing, cv::Mat& mask) {
  cv::Mat outer;
  cv::Mat inner;
  const cv::Mat disc =
      cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * reach + 1, 2 * reach + 1));
  cv::dilate(mask, outer, disc);
  cv::erode(mask, inner, disc);
  cv::Mat ratio(mask.size(), CV_32FC1);
  cv::parallel_for_(cv::Range(0, mask.rows), [&](const cv::Range& range) {
    for (int v = range.start; v < range.end; ++v) {
      const int row = std::min(v / pixels_per_local, ground.share.rows - 1);
      for (int u = 0; u < mask.cols; ++u) {
        const bool is_ground = mask.at<std::uint8_t>(v, u) != 0;
        float& value = ratio.at<float>(v, u);
        value = is_ground ? 1.0F : -1.0F;
        if (outer.at<std::uint8_t>(v, u) == inner.at<std::uint8_t>(v, u)) continue;
        const int column = std::min(u / pixels_per_local, ground.share.cols - 1);
        if (ground.share.at<float>(row, column) < kLeastShare ||
            other.share.at<float>(row, column) < kLeastShare) {
          continue;
        }
        const auto& colour = colours.at<cv::Vec3f>(v, u);
        value = std::clamp(
            LogLikelihood(colour, ground, row, column) - LogLikelihood(colour, other, row, column),
            -kLimit, kLimit);
      }
    }
  });
  if (smoothing > 0)
    cv::GaussianBlur(ratio, ratio, cv::Size(2 * smoothing + 1, 2 * smoothing + 1), 0.0);
  for (int v = 0; v < mask.rows; ++v) {
    for (int u = 0; u < mask.cols; ++u) {
      if (outer.at<std::uint8_t>(v, u) == inner.at<std::uint8_t>(v, u)) continue;
      mask.at<std::uint8_t>(v, u) = ratio.at<float>(v, u) > 0.0F ? 255 : 0;
    }
  }
}

}  // namespace

cv::Mat RefineBorders(const cv::Mat& bgr, const cv::Mat& ground, const BorderOptions& options) {
  const cv::Size half_size((bgr.cols + 1) / 2, (bgr.rows + 1) / 2);
  cv::Mat half_bgr;
  cv::resize(bgr, half_bgr, half_size, 0.0, 0.0, cv::INTER_AREA);
  const cv::Mat half = Opponent(half_bgr);
  const cv::Mat squares = half.mul(half);

  cv::Mat mask;
  cv::resize(ground, mask, half_size, 0.0, 0.0, cv::INTER_LINEAR);
  cv::threshold(mask, mask, 127.0, 255.0, cv::THRESH_BINARY);
  LocalColours inside;
  LocalColours outside;
  const auto describe = [&](int doubt) {
    cv::Mat core;
    cv::erode(mask, core, Disc(doubt));
    inside = Describe(half, squares, core, options.window_px / 2);
    cv::dilate(mask, core, Disc(doubt));
    cv::bitwise_not(core, core);
    outside = Describe(half, squares, core, options.window_px / 2);
  };
  const int reach = options.reach_px / 2;
  describe(2);
  Reassign(half, inside, outside, 1, reach, 2, mask);
  describe(1);
  Reassign(half, inside, outside, 1, std::max(reach / 2, 2), 1, mask);
  cv::medianBlur(mask, mask, 5);

  describe(1);
  cv::Mat full;
  cv::resize(mask, full, bgr.size(), 0.0, 0.0, cv::INTER_NEAREST);
  Reassign(Opponent(bgr), inside, outside, 2, 3, 1, full);
  cv::medianBlur(full, full, 5);
  return full;
}

}  // namespace beckon
