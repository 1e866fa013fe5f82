#include "services/ground_detector/mean_shift.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

namespace beckon {
namespace {

constexpr float kColourlessBelow = 0.1F;

// Shortest way round the circle from b to a; the full difference where either has no hue.
float HueDifference(float a, float b) {
  const float difference = a - b;
  if (a > 1.0F || b > 1.0F) return difference;
  return difference - std::round(difference);
}

// Texture that is left at this scale, from the picture's highest frequency: the median step between
// neighbours.
float MedianStep(const cv::Mat& hsi) {
  std::vector<float> steps;
  steps.reserve(hsi.total());
  for (int v = 0; v < hsi.rows; ++v) {
    const auto* row = hsi.ptr<cv::Vec3f>(v);
    for (int u = 1; u < hsi.cols; ++u) steps.push_back(std::abs(row[u][2] - row[u - 1][2]));
  }
  if (steps.empty()) return 0.0F;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

// Moves every cell's colour to the mode that it belongs to.
cv::Mat FindModes(const cv::Mat& hsi, float intensity_radius, const MeanShiftOptions& options) {
  cv::Mat modes(hsi.size(), CV_32FC3);
  const auto space = static_cast<float>(options.space_cells);
  cv::parallel_for_(cv::Range(0, hsi.rows), [&](const cv::Range& range) {
    for (int v = range.start; v < range.end; ++v) {
      for (int u = 0; u < hsi.cols; ++u) {
        float x = static_cast<float>(u);
        float y = static_cast<float>(v);
        cv::Vec3f colour = hsi.at<cv::Vec3f>(v, u);
        for (int iteration = 0; iteration < options.iterations; ++iteration) {
          const int left = std::max(static_cast<int>(std::ceil(x - space)), 0);
          const int right = std::min(static_cast<int>(x + space), hsi.cols - 1);
          const int top = std::max(static_cast<int>(std::ceil(y - space)), 0);
          const int bottom = std::min(static_cast<int>(y + space), hsi.rows - 1);
          float sum_x = 0.0F;
          float sum_y = 0.0F;
          cv::Vec3f sum(0.0F, 0.0F, 0.0F);
          float count = 0.0F;
          for (int row = top; row <= bottom; ++row) {
            const auto* cells = hsi.ptr<cv::Vec3f>(row);
            const float dy = static_cast<float>(row) - y;
            for (int column = left; column <= right; ++column) {
              const cv::Vec3f& cell = cells[column];
              const float intensity = (cell[2] - colour[2]) / intensity_radius;
              if (intensity * intensity >= 1.0F) continue;
              const float hue = HueDifference(cell[0], colour[0]);
              const float h = hue / options.hue;
              const float s = (cell[1] - colour[1]) / options.saturation;
              const float dx = static_cast<float>(column) - x;
              if (h * h + s * s + intensity * intensity >= 1.0F ||
                  dx * dx + dy * dy > space * space) {
                continue;
              }
              sum_x += dx;
              sum_y += dy;
              sum += cv::Vec3f(hue, cell[1] - colour[1], cell[2] - colour[2]);
              count += 1.0F;
            }
          }
          if (count == 0.0F) break;
          x += sum_x / count;
          y += sum_y / count;
          colour += sum * (1.0F / count);
          if (colour[0] < 1.5F) colour[0] -= std::floor(colour[0]);
          const float moved = std::abs(sum_x) + std::abs(sum_y);
          if (moved < 0.2F * count && std::abs(sum[2]) < 0.02F * intensity_radius * count) break;
        }
        modes.at<cv::Vec3f>(v, u) = colour;
      }
    }
  });
  return modes;
}

// Disjoint sets of cells.
class Sets {
 public:
  explicit Sets(int size) : parent_(static_cast<std::size_t>(size)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int Find(int i) {
    while (At(i) != i) {
      At(i) = At(At(i));
      i = At(i);
    }
    return i;
  }
  void Join(int a, int b) { At(Find(a)) = Find(b); }

 private:
  int& At(int i) { return parent_[static_cast<std::size_t>(i)]; }
  std::vector<int> parent_;
};

template <typename Visit>
void ForEachNeighbourPair(const cv::Size& size, const Visit& visit) {
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const int i = v * size.width + u;
      if (u + 1 < size.width) visit(i, i + 1);
      if (v + 1 < size.height) visit(i, i + size.width);
    }
  }
}

}  // namespace

cv::Mat HsiFromBgr(const cv::Mat& bgr) {
  CV_Assert(bgr.type() == CV_8UC3);
  cv::Mat hsi(bgr.size(), CV_32FC3);
  for (int v = 0; v < bgr.rows; ++v) {
    const auto* from = bgr.ptr<cv::Vec3b>(v);
    auto* to = hsi.ptr<cv::Vec3f>(v);
    for (int u = 0; u < bgr.cols; ++u) {
      const auto b = static_cast<float>(from[u][0]);
      const auto g = static_cast<float>(from[u][1]);
      const auto r = static_cast<float>(from[u][2]);
      const float sum = b + g + r;
      const float intensity = sum / 765.0F;
      const float saturation = sum > 0.0F ? 1.0F - 3.0F * std::min({b, g, r}) / sum : 0.0F;
      float hue = kColourlessHue;
      if (saturation >= kColourlessBelow && intensity >= kColourlessBelow) {
        hue = std::atan2(std::numbers::sqrt3_v<float> * (g - b), 2.0F * r - g - b) /
              (2.0F * std::numbers::pi_v<float>);
        if (hue < 0.0F) hue += 1.0F;
      }
      to[u] = {hue, saturation, intensity};
    }
  }
  return hsi;
}

Segmentation MeanShiftSegments(const cv::Mat& hsi, const MeanShiftOptions& options) {
  CV_Assert(hsi.type() == CV_32FC3);
  const float intensity_radius = std::clamp(options.texture_gain * MedianStep(hsi),
                                            options.intensity_min, options.intensity_max);
  const cv::Mat modes = FindModes(hsi, intensity_radius, options);

  // Neighbours with one mode are one segment.
  const auto mode = [&](int i) { return modes.at<cv::Vec3f>(i / hsi.cols, i % hsi.cols); };
  const auto unlikeness = [&](const cv::Vec3f& a, const cv::Vec3f& b) {
    const float h = HueDifference(a[0], b[0]) / options.hue;
    const float s = (a[1] - b[1]) / options.saturation;
    const float i = (a[2] - b[2]) / intensity_radius;
    return h * h + s * s + i * i;
  };
  Sets sets(static_cast<int>(hsi.total()));
  ForEachNeighbourPair(hsi.size(), [&](int a, int b) {
    if (unlikeness(mode(a), mode(b)) < 0.25F) sets.Join(a, b);
  });

  // Specks join the most similar neighbour, until there are none (each round at least halves them).
  std::vector<int> size(hsi.total());
  for (bool again = true; again;) {
    again = false;
    std::fill(size.begin(), size.end(), 0);
    for (int i = 0; i < static_cast<int>(hsi.total()); ++i) {
      ++size[static_cast<std::size_t>(sets.Find(i))];
    }
    struct Offer {
      float unlikeness = std::numeric_limits<float>::infinity();
      int to = -1;
    };
    std::vector<Offer> offers(hsi.total());
    ForEachNeighbourPair(hsi.size(), [&](int a, int b) {
      const int set_a = sets.Find(a);
      const int set_b = sets.Find(b);
      if (set_a == set_b) return;
      const float value = unlikeness(mode(a), mode(b));
      for (const auto& [from, to] : {std::pair(set_a, set_b), std::pair(set_b, set_a)}) {
        Offer& offer = offers[static_cast<std::size_t>(from)];
        if (size[static_cast<std::size_t>(from)] < options.min_cells && value < offer.unlikeness) {
          offer = {value, to};
        }
      }
    });
    for (int i = 0; i < static_cast<int>(offers.size()); ++i) {
      const int to = offers[static_cast<std::size_t>(i)].to;
      if (to >= 0 && sets.Find(i) != sets.Find(to)) {
        sets.Join(i, to);
        again = true;
      }
    }
  }

  Segmentation segmentation;
  segmentation.ids.create(hsi.size(), CV_32SC1);
  std::vector<int> number(hsi.total(), -1);
  for (int i = 0; i < static_cast<int>(hsi.total()); ++i) {
    int& n = number[static_cast<std::size_t>(sets.Find(i))];
    if (n < 0) n = segmentation.count++;
    segmentation.ids.at<int>(i / hsi.cols, i % hsi.cols) = n;
  }
  return segmentation;
}

}  // namespace beckon
