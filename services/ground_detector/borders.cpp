#include "services/ground_detector/borders.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace beckon {
namespace {

constexpr int kBlock = 4;               // half-size pixels along a side of a block
constexpr float kLeastVariance = 9.0F;  // sensor noise, grey levels squared
constexpr float kLimit = 4.0F;          // log-ratio that one pixel can say
constexpr float kFeetMargin = 2.0F;     // log-odds of ground by motion that do not count
constexpr float kHardlyAlike = 0.05F;   // feet that have less than this to say are not looked for
constexpr float kLeastShare = 0.01F;    // of the window that a side needs to be described

// Intensity and two opponent colours: less correlated than blue, green and red.
cv::Vec3f Opponent(const cv::Vec3b& bgr) {
  const auto b = static_cast<float>(bgr[0]);
  const auto g = static_cast<float>(bgr[1]);
  const auto r = static_cast<float>(bgr[2]);
  return {(b + g + r) / 3.0F, 0.7F * (r - g), 0.4F * (g + r) - 0.8F * b};
}

// Count, and sums of three colours and of their squares.
using Sums = cv::Vec<float, 7>;

void AddPixel(const cv::Vec3b& bgr, Sums& sums) {
  const cv::Vec3f colour = Opponent(bgr);
  sums[0] += 1.0F;
  for (int i = 0; i < 3; ++i) {
    sums[i + 1] += colour[i];
    sums[i + 4] += colour[i] * colour[i];
  }
}

// Normal distribution of the colours of one side around a block, without covariances.
struct LocalColours {
  bool known = false;
  cv::Vec3f mean;
  cv::Vec3f inverse_variance;
  float log_scale = 0.0F;

  float LogDensity(const cv::Vec3f& colour) const {
    const cv::Vec3f difference = colour - mean;
    return log_scale - 0.5F * difference.mul(difference).dot(inverse_variance);
  }
};

using ColourGrid = std::vector<LocalColours>;  // row by row

class Describer {
 public:
  // `bgr`: half size.
  Describer(const cv::Mat& bgr, int window_px)
      : bgr_(bgr),
        grid_((bgr.cols + kBlock - 1) / kBlock, (bgr.rows + kBlock - 1) / kBlock),
        window_(2 * std::max(window_px / kBlock, 1) + 1),
        all_(grid_, CV_32FC(7), cv::Scalar(0.0)) {
    for (int v = 0; v < bgr.rows; ++v) {
      const auto* row = bgr.ptr<cv::Vec3b>(v);
      auto* sums = all_.ptr<Sums>(v / kBlock);
      for (int u = 0; u < bgr.cols; ++u) AddPixel(row[u], sums[u / kBlock]);
    }
  }

  // What the pixels in `core` (255) look like in the window around each block.
  ColourGrid Describe(const cv::Mat& core) const {
    cv::Mat sums(grid_, CV_32FC(7));
    for (int row = 0; row < grid_.height; ++row) {
      for (int column = 0; column < grid_.width; ++column) {
        sums.at<Sums>(row, column) = SumsOf(core, row, column);
      }
    }
    cv::boxFilter(sums, sums, CV_32F, cv::Size(window_, window_), cv::Point(-1, -1), false,
                  cv::BORDER_CONSTANT);
    const float least = kLeastShare * static_cast<float>(window_ * window_ * kBlock * kBlock);
    ColourGrid described(static_cast<std::size_t>(grid_.area()));
    for (std::size_t i = 0; i < described.size(); ++i) {
      const auto* row = sums.ptr<Sums>(static_cast<int>(i) / grid_.width);
      const Sums& sum = row[static_cast<int>(i) % grid_.width];
      if (sum[0] < least) continue;
      LocalColours& local = described[i];
      local.known = true;
      for (int k = 0; k < 3; ++k) {
        local.mean[k] = sum[k + 1] / sum[0];
        const float variance =
            std::max(sum[k + 4] / sum[0] - local.mean[k] * local.mean[k], 0.0F) + kLeastVariance;
        local.inverse_variance[k] = 1.0F / variance;
        local.log_scale -= 0.5F * std::log(variance);
      }
    }
    return described;
  }

  // Of the block that holds a half-size pixel.
  std::size_t Index(int v, int u) const {
    return static_cast<std::size_t>(std::min(v / kBlock, grid_.height - 1) * grid_.width +
                                    std::min(u / kBlock, grid_.width - 1));
  }

 private:
  Sums SumsOf(const cv::Mat& core, int row, int column) const {
    const int bottom = std::min((row + 1) * kBlock, core.rows);
    const int right = std::min((column + 1) * kBlock, core.cols);
    Sums some = Sums::all(0.0F);
    int missing = 0;
    for (int v = row * kBlock; v < bottom; ++v) {
      const auto* mask = core.ptr<std::uint8_t>(v);
      for (int u = column * kBlock; u < right; ++u) missing += mask[u] == 0 ? 1 : 0;
    }
    if (missing == 0) return all_.at<Sums>(row, column);
    if (missing == (bottom - row * kBlock) * (right - column * kBlock)) return some;
    for (int v = row * kBlock; v < bottom; ++v) {
      for (int u = column * kBlock; u < right; ++u) {
        if (core.at<std::uint8_t>(v, u) != 0) AddPixel(bgr_.at<cv::Vec3b>(v, u), some);
      }
    }
    return some;
  }

  const cv::Mat& bgr_;
  cv::Size grid_;
  int window_;   // blocks along a side
  cv::Mat all_;  // Sums of each block
};

cv::Mat Disc(int radius) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * radius + 1, 2 * radius + 1));
}

cv::Mat Square(int radius) { return cv::Mat::ones(2 * radius + 1, 2 * radius + 1, CV_8UC1); }

// What each side looks like away from the border by more than `doubt`.
struct Sides {
  ColourGrid ground;
  ColourGrid other;
};

Sides DescribeSides(const Describer& describer, const cv::Mat& mask, int doubt) {
  cv::Mat core;
  cv::erode(mask, core, Disc(doubt));
  Sides sides;
  sides.ground = describer.Describe(core);
  cv::dilate(mask, core, Disc(doubt));
  cv::bitwise_not(core, core);
  sides.other = describer.Describe(core);
  return sides;
}

// Bhattacharyya coefficient of two sides: 1 where they look the same; 0 if either is not known, as
// of something narrow, whose foot motion does not tell either.
float Overlap(const LocalColours& a, const LocalColours& b) {
  if (!a.known || !b.known) return 0.0F;
  float distance = 0.5F * (a.log_scale + b.log_scale);
  for (int i = 0; i < 3; ++i) {
    const float variance = 0.5F * (1.0F / a.inverse_variance[i] + 1.0F / b.inverse_variance[i]);
    const float difference = a.mean[i] - b.mean[i];
    distance += 0.125F * difference * difference / variance + 0.5F * std::log(variance);
  }
  return std::exp(-distance);
}

// The foot by motion has its say as far as the colours of both sides are alike. What is called
// ground is driven on, so that needs the clearer word.
void AddFeet(const FeetFinder& find_feet, float limit, const Describer& describer,
             const Sides& sides, cv::Mat& prior, cv::Mat& mask) {
  std::vector<float> alike;
  for (std::size_t block = 0; block < sides.ground.size(); ++block) {
    alike.push_back(Overlap(sides.ground[block], sides.other[block]));
  }
  cv::Mat where(mask.size(), CV_8UC1);
  for (int v = 0; v < where.rows; ++v) {
    auto* is_wanted = where.ptr<std::uint8_t>(v);
    for (int u = 0; u < where.cols; ++u) {
      is_wanted[u] = alike[describer.Index(v, u)] > kHardlyAlike ? 255 : 0;
    }
  }
  const cv::Mat feet = find_feet(mask, where);
  for (int v = 0; v < feet.rows; ++v) {
    const auto* foot = feet.ptr<float>(v);
    auto* value = prior.ptr<float>(v);
    auto* is_ground = mask.ptr<std::uint8_t>(v);
    for (int u = 0; u < feet.cols; ++u) {
      if (std::isnan(foot[u])) continue;
      const float surely = foot[u] > 0.0F ? std::max(foot[u] - kFeetMargin, 0.0F) : foot[u];
      value[u] += alike[describer.Index(v, u)] * std::clamp(surely, -limit, limit);
      is_ground[u] = value[u] > 0.0F ? 255 : 0;
    }
  }
}

// One pass: the pixels within `reach` of the border are assigned anew. `prior`: CV_32FC1, log-odds
// that a pixel has before its colour is asked. `half`: pixels of `bgr` along a half-size pixel.
void Reassign(const cv::Mat& bgr, const cv::Mat& prior, const Describer& describer,
              const Sides& sides, int half, int reach, int smoothing, cv::Mat& mask) {
  cv::Mat outer;
  cv::Mat inner;
  cv::dilate(mask, outer, Square(reach));
  cv::erode(mask, inner, Square(reach));
  cv::Mat ratio(mask.size(), CV_32FC1);
  for (int v = 0; v < mask.rows; ++v) {
    const auto* is_ground = mask.ptr<std::uint8_t>(v);
    const auto* out = outer.ptr<std::uint8_t>(v);
    const auto* in = inner.ptr<std::uint8_t>(v);
    const auto* colours = bgr.ptr<cv::Vec3b>(v);
    const auto* before = prior.ptr<float>(v);
    auto* value = ratio.ptr<float>(v);
    for (int u = 0; u < mask.cols; ++u) {
      value[u] = is_ground[u] != 0 ? 1.0F : -1.0F;
      if (out[u] == in[u]) continue;
      const std::size_t block = describer.Index(v / half, u / half);
      const LocalColours& ground = sides.ground[block];
      const LocalColours& other = sides.other[block];
      if (!ground.known || !other.known) continue;
      const cv::Vec3f colour = Opponent(colours[u]);
      const float by_colour = ground.LogDensity(colour) - other.LogDensity(colour);
      value[u] = before[u] + std::clamp(by_colour, -kLimit, kLimit);
    }
  }
  cv::GaussianBlur(ratio, ratio, cv::Size(2 * smoothing + 1, 2 * smoothing + 1), 0.0);
  for (int v = 0; v < mask.rows; ++v) {
    auto* is_ground = mask.ptr<std::uint8_t>(v);
    const auto* out = outer.ptr<std::uint8_t>(v);
    const auto* in = inner.ptr<std::uint8_t>(v);
    const auto* value = ratio.ptr<float>(v);
    for (int u = 0; u < mask.cols; ++u) {
      if (out[u] != in[u]) is_ground[u] = value[u] > 0.0F ? 255 : 0;
    }
  }
}

}  // namespace

cv::Mat RefineBorders(const cv::Mat& bgr, const cv::Mat& ground, const cv::Mat& log_odds,
                      const FeetFinder& find_feet, const BorderOptions& options) {
  const cv::Size half_size((bgr.cols + 1) / 2, (bgr.rows + 1) / 2);
  cv::Mat half;
  cv::resize(bgr, half, half_size, 0.0, 0.0, cv::INTER_AREA);
  const Describer describer(half, options.window_px / 2);

  cv::Mat mask;
  cv::resize(ground, mask, half_size, 0.0, 0.0, cv::INTER_LINEAR);
  cv::threshold(mask, mask, 127.0, 255.0, cv::THRESH_BINARY);
  cv::Mat prior;
  cv::resize(options.cells_weight * log_odds, prior, half_size, 0.0, 0.0, cv::INTER_LINEAR);
  const Sides first_sides = DescribeSides(describer, mask, 2);
  if (find_feet) AddFeet(find_feet, options.feet_limit, describer, first_sides, prior, mask);
  const int reach = options.reach_px / 2;
  Reassign(half, prior, describer, first_sides, 1, reach, 2, mask);
  Reassign(half, prior, describer, DescribeSides(describer, mask, 1), 1, std::max(reach / 2, 2), 1,
           mask);
  cv::medianBlur(mask, mask, 5);

  const Sides sides = DescribeSides(describer, mask, 1);
  cv::Mat full;
  cv::resize(mask, full, bgr.size(), 0.0, 0.0, cv::INTER_NEAREST);
  cv::resize(prior, prior, bgr.size(), 0.0, 0.0, cv::INTER_LINEAR);
  Reassign(bgr, prior, describer, sides, 2, 3, 1, full);
  cv::medianBlur(full, full, 5);
  return full;
}

}  // namespace beckon
