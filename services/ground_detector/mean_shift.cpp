#include "services/ground_detector/mean_shift.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

namespace beckon {
namespace {

constexpr float kDarkBelow = 0.1F;

// Intensity and the chroma plane, in which saturation is the radius and hue the angle: a hue counts
// by how much of it there is, and what is colourless lies in the middle, apart from all hues.
cv::Mat ConeFromHsi(const cv::Mat& hsi) {
  cv::Mat cone(hsi.size(), CV_32FC3);
  for (int v = 0; v < hsi.rows; ++v) {
    for (int u = 0; u < hsi.cols; ++u) {
      const auto& cell = hsi.at<cv::Vec3f>(v, u);
      const bool colourless = cell[0] == kColourlessHue;
      const float angle = 2.0F * std::numbers::pi_v<float> * cell[0];
      const float radius = colourless ? 0.0F : cell[1];
      cone.at<cv::Vec3f>(v, u) = {radius * std::cos(angle), radius * std::sin(angle), cell[2]};
    }
  }
  return cone;
}

float Median(std::vector<float>& values) {
  if (values.empty()) return 0.0F;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// One over the radii of the kernel, for each channel of the cone.
cv::Vec3f InverseRadii(const cv::Mat& cone, const MeanShiftOptions& options) {
  std::vector<float> chroma;
  std::vector<float> intensity;
  for (int v = 0; v < cone.rows; ++v) {
    const auto* row = cone.ptr<cv::Vec3f>(v);
    for (int u = 1; u < cone.cols; ++u) {
      const cv::Vec3f step = row[u] - row[u - 1];
      chroma.push_back(std::hypot(step[0], step[1]));
      intensity.push_back(std::abs(step[2]));
    }
  }
  const auto inverse = [](const Bandwidth& bandwidth, std::vector<float>& steps) {
    return 1.0F / std::clamp(bandwidth.gain * Median(steps), bandwidth.min, bandwidth.max);
  };
  const float chroma_inverse = inverse(options.chroma, chroma);
  return {chroma_inverse, chroma_inverse, inverse(options.intensity, intensity)};
}

// Moves every cell's colour to the mode that it belongs to. `cone` is in units of the kernel's
// radii.
cv::Mat FindModes(const cv::Mat& cone, const MeanShiftOptions& options) {
  cv::Mat modes(cone.size(), CV_32FC3);
  const auto space = static_cast<float>(options.space_cells);
  cv::parallel_for_(cv::Range(0, cone.rows), [&](const cv::Range& range) {
    for (int v = range.start; v < range.end; ++v) {
      for (int u = 0; u < cone.cols; ++u) {
        float x = static_cast<float>(u);
        float y = static_cast<float>(v);
        cv::Vec3f colour = cone.at<cv::Vec3f>(v, u);
        for (int iteration = 0; iteration < options.iterations; ++iteration) {
          const int left = std::max(static_cast<int>(std::ceil(x - space)), 0);
          const int right = std::min(static_cast<int>(x + space), cone.cols - 1);
          const int top = std::max(static_cast<int>(std::ceil(y - space)), 0);
          const int bottom = std::min(static_cast<int>(y + space), cone.rows - 1);
          float sum_x = 0.0F;
          float sum_y = 0.0F;
          cv::Vec3f sum(0.0F, 0.0F, 0.0F);
          float count = 0.0F;
          for (int row = top; row <= bottom; ++row) {
            const auto* cells = cone.ptr<cv::Vec3f>(row);
            const float dy = static_cast<float>(row) - y;
            for (int column = left; column <= right; ++column) {
              const cv::Vec3f offset = cells[column] - colour;
              const float dx = static_cast<float>(column) - x;
              if (offset.dot(offset) >= 1.0F || dx * dx + dy * dy > space * space) continue;
              sum_x += dx;
              sum_y += dy;
              sum += offset;
              count += 1.0F;
            }
          }
          if (count == 0.0F) break;
          x += sum_x / count;
          y += sum_y / count;
          colour += sum * (1.0F / count);
          if (std::abs(sum_x) + std::abs(sum_y) < 0.2F * count &&
              sum.dot(sum) < 4e-4F * count * count) {
            break;
          }
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

cv::Mat HsiFromBgr(const cv::Mat& bgr, float colourless_saturation) {
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
      if (saturation >= colourless_saturation && intensity >= kDarkBelow) {
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
  cv::Mat cone = ConeFromHsi(hsi);
  const cv::Vec3f inverse = InverseRadii(cone, options);
  cv::multiply(cone, cv::Scalar(inverse[0], inverse[1], inverse[2]), cone);
  const cv::Mat modes = FindModes(cone, options);

  // Neighbours with one mode are one segment.
  const auto unlikeness = [&](int a, int b) {
    const cv::Vec3f difference = modes.at<cv::Vec3f>(a / hsi.cols, a % hsi.cols) -
                                 modes.at<cv::Vec3f>(b / hsi.cols, b % hsi.cols);
    return difference.dot(difference);
  };
  Sets sets(static_cast<int>(hsi.total()));
  ForEachNeighbourPair(hsi.size(), [&](int a, int b) {
    if (unlikeness(a, b) < 0.25F) sets.Join(a, b);
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
      const float value = unlikeness(a, b);
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
  segmentation.colours = cone;
  segmentation.modes = modes;
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
