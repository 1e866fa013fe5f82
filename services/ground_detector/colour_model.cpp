#include "services/ground_detector/colour_model.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

constexpr float kForgetting = 0.97F;       // per frame: a new floor takes over within some 3 s
constexpr float kGroundNovelty = 0.03F;    // probability that ground has a colour not seen before
constexpr float kNotGroundNovelty = 0.5F;  // the same for all else
constexpr float kNovelDensity = 1.0F / 1500.0F;  // of a new colour in a bin; most bins never occur

}  // namespace

int ColourModel::Bin(const cv::Vec3b& bgr) {
  const int b = bgr[0];
  const int g = bgr[1];
  const int r = bgr[2];
  const int intensity = (b + g + r) / 3 * kIntensityBins / 256;
  // Red against green and both against blue, 5 grey levels a bin: what differs by more is rare.
  const int red_green = std::clamp((r - g) / 5 + kOpponentBins / 2, 0, kOpponentBins - 1);
  const int yellow_blue =
      std::clamp(((r + g) / 2 - b) / 5 + kOpponentBins / 2, 0, kOpponentBins - 1);
  return (intensity * kOpponentBins + red_green) * kOpponentBins + yellow_blue;
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
  const auto density = [bin](const Histogram& histogram, float novelty) {
    const float seen = histogram.total > 0.0F ? histogram.smooth[bin] / histogram.total : 0.0F;
    return (1.0F - novelty) * seen + novelty * kNovelDensity;
  };
  const float ratio = density(ground_, kGroundNovelty) / density(not_ground_, kNotGroundNovelty);
  return std::clamp(std::log(ratio), -kLimit, kLimit);
}

}  // namespace beckon
