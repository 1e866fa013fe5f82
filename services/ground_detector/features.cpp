#include "services/ground_detector/features.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace beckon {
namespace {

constexpr int kScale = 2;     // pixels between samples; Haar responses are 2 * kScale wide
constexpr int kSamples = 20;  // samples along a side of the window
constexpr int kHalf = kSamples / 2;
constexpr int kCells = 4;  // cells along a side
constexpr int kCellSamples = kSamples / kCells;

// Weight of sample `i` in cell `cell`, along one axis, is folded into 1 / (4 + |du| + |dv|); a cell
// reaches one sample over its border so that neighbours blend.
struct CellWeight {
  int cell;
  float weight;
};
struct SampleWeights {
  std::array<CellWeight, 4> cells{};  // a sample counts in up to four cells
  int count = 0;
};

std::array<SampleWeights, kSamples * kSamples> MakeWeights() {
  std::array<SampleWeights, kSamples * kSamples> weights;
  for (int cell = 0; cell < kCells * kCells; ++cell) {
    const int row0 = (cell / kCells) * kCellSamples;
    const int column0 = (cell % kCells) * kCellSamples;
    for (int row = std::max(row0 - 1, 0); row <= std::min(row0 + kCellSamples, kSamples - 1);
         ++row) {
      for (int column = std::max(column0 - 1, 0);
           column <= std::min(column0 + kCellSamples, kSamples - 1); ++column) {
        const int distance = std::abs(row0 + 2 - row) + std::abs(column0 + 2 - column);
        SampleWeights& sample = weights[static_cast<std::size_t>(row * kSamples + column)];
        sample.cells[static_cast<std::size_t>(sample.count++)] = {
            cell, 1.0F / static_cast<float>(4 + distance)};
      }
    }
  }
  return weights;
}

// Smaller over greater eigenvalue of the structure tensor around a pixel: near 0 on a straight
// edge, where a corner of the pixel grid can be found again anywhere along it.
float Cornerness(const cv::Mat& grey, int u, int v) {
  constexpr int kRadius = 4;
  float xx = 0.0F;
  float xy = 0.0F;
  float yy = 0.0F;
  for (int y = v - kRadius; y <= v + kRadius; ++y) {
    const auto* above = grey.ptr<std::uint8_t>(y - 1);
    const auto* row = grey.ptr<std::uint8_t>(y);
    const auto* below = grey.ptr<std::uint8_t>(y + 1);
    for (int x = u - kRadius; x <= u + kRadius; ++x) {
      const auto dx = static_cast<float>(row[x + 1] - row[x - 1]);
      const auto dy = static_cast<float>(below[x] - above[x]);
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }
  const float mean = 0.5F * (xx + yy);
  const float spread = std::hypot(0.5F * (xx - yy), xy);
  return mean > 0.0F ? (mean - spread) / (mean + spread) : 0.0F;
}

}  // namespace

SurfDescriptor UprightSurf(const cv::Mat& integral, int u, int v) {
  static const auto weights = MakeWeights();
  SurfDescriptor descriptor{};
  for (int row = 0; row < kSamples; ++row) {
    const int v_sample = v + (row - kHalf) * kScale;
    const int* top = integral.ptr<int>(v_sample - kScale);
    const int* middle = integral.ptr<int>(v_sample);
    const int* bottom = integral.ptr<int>(v_sample + kScale);
    for (int column = 0; column < kSamples; ++column) {
      const int centre = u + (column - kHalf) * kScale;
      const int left = centre - kScale;
      const int right = centre + kScale;
      const int all = bottom[right] - bottom[left] - top[right] + top[left];
      const int left_half = bottom[centre] - bottom[left] - top[centre] + top[left];
      const int top_half = middle[right] - middle[left] - top[right] + top[left];
      const auto dx = static_cast<float>(all - 2 * left_half);
      const auto dy = static_cast<float>(all - 2 * top_half);
      const SampleWeights& sample = weights[static_cast<std::size_t>(row * kSamples + column)];
      for (int i = 0; i < sample.count; ++i) {
        const auto [cell, weight] = sample.cells[static_cast<std::size_t>(i)];
        float* sums = &descriptor[static_cast<std::size_t>(4 * cell)];
        sums[0] += weight * dx;
        sums[1] += weight * dy;
        sums[2] += weight * std::abs(dx);
        sums[3] += weight * std::abs(dy);
      }
    }
  }
  float squared = 0.0F;
  for (const float value : descriptor) squared += value * value;
  const float scale = 1.0F / (std::sqrt(squared) + 1e-7F);
  for (float& value : descriptor) value *= scale;
  return descriptor;
}

float DescriptorDistance(const SurfDescriptor& a, const SurfDescriptor& b) {
  float squared = 0.0F;
  for (std::size_t i = 0; i < a.size(); ++i) squared += (a[i] - b[i]) * (a[i] - b[i]);
  return squared;
}

std::vector<Feature> DetectFeatures(const cv::Mat& grey, const FeatureOptions& options) {
  if (grey.cols <= 2 * kFeatureBorderPx || grey.rows <= 2 * kFeatureBorderPx) return {};
  std::vector<cv::KeyPoint> corners;
  cv::FAST(grey, corners, options.fast_threshold, true);

  const int columns = (grey.cols + options.cell_px - 1) / options.cell_px;
  const int rows = (grey.rows + options.cell_px - 1) / options.cell_px;
  std::vector<std::vector<cv::KeyPoint>> cells(static_cast<std::size_t>(columns * rows));
  for (const cv::KeyPoint& corner : corners) {
    const auto u = static_cast<int>(corner.pt.x);
    const auto v = static_cast<int>(corner.pt.y);
    if (u < kFeatureBorderPx || v < kFeatureBorderPx || u >= grey.cols - kFeatureBorderPx ||
        v >= grey.rows - kFeatureBorderPx) {
      continue;
    }
    if (Cornerness(grey, u, v) < options.least_cornerness) continue;
    cells[static_cast<std::size_t>(v / options.cell_px * columns + u / options.cell_px)].push_back(
        corner);
  }

  cv::Mat integral;
  cv::integral(grey, integral, CV_32S);
  std::vector<Feature> features;
  const auto per_cell = static_cast<std::size_t>(options.per_cell);
  for (auto& cell : cells) {
    const std::size_t kept = std::min(per_cell, cell.size());
    std::partial_sort(
        cell.begin(), cell.begin() + static_cast<std::ptrdiff_t>(kept), cell.end(),
        [](const cv::KeyPoint& a, const cv::KeyPoint& b) { return a.response > b.response; });
    for (std::size_t i = 0; i < kept; ++i) {
      features.push_back({cell[i].pt, cell[i].response, {}});
    }
  }
  cv::parallel_for_(cv::Range(0, static_cast<int>(features.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      Feature& feature = features[static_cast<std::size_t>(i)];
      feature.descriptor = UprightSurf(integral, static_cast<int>(feature.pixel.x),
                                       static_cast<int>(feature.pixel.y));
    }
  });
  return features;
}

}  // namespace beckon
