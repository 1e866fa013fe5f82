#include "services/ground_detector/colour_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace beckon {
namespace {

constexpr float kForgetting = 0.97F;  // per frame: a new floor takes over within some 3 s
// Probability of a colour not seen before. The same for ground and for all else: that a colour is
// new says nothing, it may be the next room's floor as well as the next thing.
constexpr float kNovelty = 0.3F;
constexpr float kNovelDensity = 1.0F / 1500.0F;  // of a new colour in a bin; most bins never occur

// Probability that what is seen of either lies in a shadow, and the light that is left there.
constexpr float kShadow = 0.2F;
constexpr std::array kShadowLight = {0.5F, 0.6F, 0.7F, 0.8F, 0.9F};

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
}

float ColourModel::LogRatio(const cv::Vec3b& bgr) const {
  const auto bin = static_cast<std::size_t>(Bin(bgr));
  std::array<std::size_t, kShadowLight.size()> lit_bins{};
  for (std::size_t i = 0; i < lit_bins.size(); ++i) {
    cv::Vec3b lit;
    for (int k = 0; k < 3; ++k) lit[k] = cv::saturate_cast<std::uint8_t>(bgr[k] / kShadowLight[i]);
    lit_bins[i] = static_cast<std::size_t>(Bin(lit));
  }
  const auto density = [&](const Histogram& histogram) {
    float in_light = 0.0F;
    for (const std::size_t lit : lit_bins) in_light += histogram.smooth[lit];
    in_light /= static_cast<float>(lit_bins.size());
    const float seen = (1.0F - kNovelty - kShadow) * histogram.smooth[bin] + kShadow * in_light;
    return (histogram.total > 0.0F ? seen / histogram.total : 0.0F) + kNovelty * kNovelDensity;
  };
  return std::clamp(std::log(density(ground_) / density(not_ground_)), -kLimit, kLimit);
}

}  // namespace beckon
