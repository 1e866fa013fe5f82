#include "services/ground_detector/colour_model.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr float kForgetting = 0.97F;       // per frame: a new floor takes over within some 3 s
constexpr float kGroundNovelty = 0.15F;    // probability that ground has a colour not seen before
constexpr float kNotGroundNovelty = 0.5F;  // the same for all else
constexpr float kNovelDensity = 1.0F / 1500.0F;  // of a new colour in a bin; most bins never occur

constexpr float kShadowChroma = 0.05F;    // share of all ground that a hue needs to cast shadows on
constexpr float kDarkestShadow = 0.45F;   // light in a shadow, over light beside it
constexpr float kBrightestGlare = 1.15F;  // the same for a reflection on a glossy floor
constexpr float kShadowLogRatio = -0.2F;

// Bins of an opponent colour widen with the square root, as pale colours differ by little and
// strong ones by much.
int OpponentBin(float opponent, int bins) {
  const int root = static_cast<int>(std::lround(2.0F * std::sqrt(std::abs(opponent))));
  return std::clamp((opponent < 0.0F ? -root : root) + bins / 2, 0, bins - 1);
}

float Intensity(const cv::Vec3b& bgr) {
  return static_cast<float>(bgr[0] + bgr[1] + bgr[2]) / 3.0F;
}

// Red against green, and both against blue.
cv::Vec2f Opponents(const cv::Vec3b& bgr) {
  const auto b = static_cast<float>(bgr[0]);
  const auto g = static_cast<float>(bgr[1]);
  const auto r = static_cast<float>(bgr[2]);
  return {r - g, 0.5F * (r + g) - b};
}

}  // namespace

int ColourModel::Bin(const cv::Vec3b& bgr) {
  const int intensity = static_cast<int>(Intensity(bgr)) * kIntensityBins / 256;
  const cv::Vec2f opponents = Opponents(bgr);
  return (intensity * kOpponentBins + OpponentBin(opponents[0], kOpponentBins)) * kOpponentBins +
         OpponentBin(opponents[1], kOpponentBins);
}

int ColourModel::ChromaBin(const cv::Vec3b& bgr) {
  // As they would be at medium light.
  const cv::Vec2f opponents = Opponents(bgr) * (128.0F / std::max(Intensity(bgr), 1.0F));
  return OpponentBin(opponents[0], kOpponentBins) * kOpponentBins +
         OpponentBin(opponents[1], kOpponentBins);
}

void ColourModel::AddGround(const cv::Vec3b& bgr) {
  Add(ground_, bgr);
  const auto bin = static_cast<std::size_t>(ChromaBin(bgr));
  chroma_[bin] += 1.0F;
  chroma_light_[bin] += Intensity(bgr);
}

bool ColourModel::MayBeLitOtherwise(const cv::Vec3b& bgr) const {
  // The bins around it count as well: what lights a shadow has a hue of its own.
  const int bin = ChromaBin(bgr);
  float count = 0.0F;
  float light = 0.0F;
  for (int row = std::max(bin / kOpponentBins - 1, 0);
       row <= std::min(bin / kOpponentBins + 1, kOpponentBins - 1); ++row) {
    for (int column = std::max(bin % kOpponentBins - 1, 0);
         column <= std::min(bin % kOpponentBins + 1, kOpponentBins - 1); ++column) {
      const auto neighbour = static_cast<std::size_t>(row * kOpponentBins + column);
      count += chroma_[neighbour];
      light += chroma_light_[neighbour];
    }
  }
  if (count <= kShadowChroma * ground_.total) return false;
  const float share = Intensity(bgr) / (light / count);
  return share > kDarkestShadow && share < kBrightestGlare;
}

void ColourModel::Add(Histogram& histogram, const cv::Vec3b& bgr) {
  histogram.added[static_cast<std::size_t>(Bin(bgr))] += 1.0F;
  histogram.total += 1.0F;
}

// Each count spreads to its neighbours, 1 2 1 along each axis, so that one shade lighter is not a
// new colour. Counts at the ends stay where they are.
void ColourModel::Smooth(Histogram& histogram) {
  histogram.smooth = histogram.added;
  std::vector<float> line;
  const auto along = [&](int stride, int length) {
    line.resize(static_cast<std::size_t>(length));
    for (int start = 0; start < kBins; ++start) {
      if (start / stride % length != 0) continue;
      float* bins = &histogram.smooth[static_cast<std::size_t>(start)];
      bool any = false;
      for (int i = 0; i < length; ++i) {
        line[static_cast<std::size_t>(i)] = bins[i * stride];
        any = any || bins[i * stride] > 0.0F;
      }
      if (!any) continue;
      for (int i = 0; i < length; ++i) {
        const float lower = line[static_cast<std::size_t>(std::max(i - 1, 0))];
        const float upper = line[static_cast<std::size_t>(std::min(i + 1, length - 1))];
        bins[i * stride] = 0.5F * line[static_cast<std::size_t>(i)] + 0.25F * (lower + upper);
      }
    }
  };
  along(1, kOpponentBins);
  along(kOpponentBins, kOpponentBins);
  along(kOpponentBins * kOpponentBins, kIntensityBins);
}

void ColourModel::EndFrame() {
  for (Histogram* histogram : {&ground_, &not_ground_}) {
    for (float& count : histogram->added) count *= kForgetting;
    histogram->total *= kForgetting;
    Smooth(*histogram);
  }
  for (float& count : chroma_) count *= kForgetting;
  for (float& sum : chroma_light_) sum *= kForgetting;
}

float ColourModel::LogRatio(const cv::Vec3b& bgr) const {
  const auto bin = static_cast<std::size_t>(Bin(bgr));
  const auto density = [bin](const Histogram& histogram, float novelty) {
    const float seen = histogram.total > 0.0F ? histogram.smooth[bin] / histogram.total : 0.0F;
    return (1.0F - novelty) * seen + novelty * kNovelDensity;
  };
  const float ratio = density(ground_, kGroundNovelty) / density(not_ground_, kNotGroundNovelty);
  const float log_ratio = std::clamp(std::log(ratio), -kLimit, kLimit);
  return log_ratio < kShadowLogRatio && MayBeLitOtherwise(bgr) ? kShadowLogRatio : log_ratio;
}

}  // namespace beckon
