#include "services/ground_detector/mean_shift.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace beckon {
namespace {

constexpr float kDarkBelow = 0.1F;
constexpr float kSameColour = 0.01F;  // squared, in radii of the kernel

// Intensity and the chroma plane, in which saturation is the radius and hue the
// angle: a hue counts by how much of it there is, and what is colourless lies
// in the middle, apart from all hues.
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

// The cells' colours channel by channel, with columns added to the right that
// no kernel reaches, so that whole vectors can be read from any cell.
struct Planes {
  explicit Planes(const cv::Mat& cone) {
    constexpr double kFar = 1e6;
    std::vector<cv::Mat> split;
    cv::split(cone, split);
    for (std::size_t i = 0; i < channels.size(); ++i) {
      cv::copyMakeBorder(split[i], channels[i], 0, 0, 0, cv::v_float32x4::nlanes,
                         cv::BORDER_CONSTANT, cv::Scalar(kFar));
    }
  }
  std::array<cv::Mat, 3> channels;
};

// A point in the space of place and colour, and the mean of the cells in the
// kernel around it.
struct KernelMean {
  float x = 0.0F;
  float y = 0.0F;
  cv::Vec3f colour;
};

// The shift from `centre` to that mean; false if there is no cell in the
// kernel.
bool MeanShift(const Planes& planes, const cv::Size& size, const KernelMean& centre, float radius,
               KernelMean& shift) {
  using Vector = cv::v_float32x4;
  const int left = std::max(static_cast<int>(std::ceil(centre.x - radius)), 0);
  const int right = std::min(static_cast<int>(centre.x + radius), size.width - 1);
  const int top = std::max(static_cast<int>(std::ceil(centre.y - radius)), 0);
  const int bottom = std::min(static_cast<int>(centre.y + radius), size.height - 1);
  const Vector one = cv::v_setall_f32(1.0F);
  const Vector nothing = cv::v_setzero_f32();
  const Vector colour[] = {cv::v_setall_f32(centre.colour[0]), cv::v_setall_f32(centre.colour[1]),
                           cv::v_setall_f32(centre.colour[2])};
  Vector count = nothing;
  Vector sum_x = nothing;
  Vector sum_y = nothing;
  Vector sums[] = {nothing, nothing, nothing};
  for (int row = top; row <= bottom; ++row) {
    const float dy = static_cast<float>(row) - centre.y;
    const Vector reach = cv::v_setall_f32(radius * radius - dy * dy);
    const float* cells[] = {planes.channels[0].ptr<float>(row), planes.channels[1].ptr<float>(row),
                            planes.channels[2].ptr<float>(row)};
    for (int column = left; column <= right; column += Vector::nlanes) {
      const float first = static_cast<float>(column) - centre.x;
      const Vector dx(first, first + 1.0F, first + 2.0F, first + 3.0F);
      const Vector a = cv::v_load(cells[0] + column) - colour[0];
      const Vector b = cv::v_load(cells[1] + column) - colour[1];
      const Vector c = cv::v_load(cells[2] + column) - colour[2];
      const Vector inside = ((a * a + b * b + c * c) < one) & ((dx * dx) <= reach);
      const Vector weight = inside & one;
      count += weight;
      sum_x += inside & dx;
      sum_y += weight * cv::v_setall_f32(dy);
      sums[0] += inside & a;
      sums[1] += inside & b;
      sums[2] += inside & c;
    }
  }
  const float cells_inside = cv::v_reduce_sum(count);
  if (cells_inside == 0.0F) return false;
  const float scale = 1.0F / cells_inside;
  shift.x = scale * cv::v_reduce_sum(sum_x);
  shift.y = scale * cv::v_reduce_sum(sum_y);
  for (int i = 0; i < 3; ++i) shift.colour[i] = scale * cv::v_reduce_sum(sums[i]);
  return true;
}

// Moves every cell's colour to the mode that it belongs to. `cone` is in units
// of the kernel's radii.
cv::Mat FindModes(const cv::Mat& cone, const MeanShiftOptions& options) {
  const Planes planes(cone);
  cv::Mat modes(cone.size(), CV_32FC3);
  const auto radius = static_cast<float>(options.space_cells);
  for (int v = 0; v < cone.rows; ++v) {
    for (int u = 0; u < cone.cols; ++u) {
      KernelMean centre{static_cast<float>(u), static_cast<float>(v), cone.at<cv::Vec3f>(v, u)};
      for (int iteration = 0; iteration < options.iterations; ++iteration) {
        KernelMean shift;
        if (!MeanShift(planes, cone.size(), centre, radius, shift)) break;
        centre.x += shift.x;
        centre.y += shift.y;
        centre.colour += shift.colour;
        // From a cell that has been there before, of this very colour, the way on is known.
        const int column = cvRound(centre.x);
        const int row = cvRound(centre.y);
        if (row < v || (row == v && column < u)) {
          const cv::Vec3f difference = centre.colour - cone.at<cv::Vec3f>(row, column);
          if (difference.dot(difference) < kSameColour) {
            centre.colour = modes.at<cv::Vec3f>(row, column);
            break;
          }
        }
        if (std::abs(shift.x) + std::abs(shift.y) < 0.2F && shift.colour.dot(shift.colour) < 4e-4F)
          break;
      }
      modes.at<cv::Vec3f>(v, u) = centre.colour;
    }
  }
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

  // Specks join the most similar neighbour, until there are none (each round at
  // least halves them).
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

cv::Mat RefineSegments(const cv::Mat& bgr, const Segmentation& segmentation) {
  CV_Assert(bgr.type() == CV_8UC3);
  const cv::Mat& ids = segmentation.ids;
  cv::Mat cells;
  cv::resize(bgr, cells, ids.size(), 0.0, 0.0, cv::INTER_AREA);
  cv::Mat refined;
  cv::resize(ids, refined, bgr.size(), 0.0, 0.0, cv::INTER_NEAREST);
  struct Candidate {
    int id;
    cv::Vec3i colour;  // mean of its cells around the pixel
    int cells;
  };
  std::vector<Candidate> candidates;
  for (int row = 0; row < ids.rows; ++row) {
    for (int column = 0; column < ids.cols; ++column) {
      // The cells around, in so far as they belong to other segments; with
      // one's own, that most of the cell shows, first.
      candidates.clear();
      for (int v = std::max(row - 1, 0); v <= std::min(row + 1, ids.rows - 1); ++v) {
        for (int u = std::max(column - 1, 0); u <= std::min(column + 1, ids.cols - 1); ++u) {
          const int id = ids.at<int>(v, u);
          auto found = std::find_if(candidates.begin(), candidates.end(),
                                    [id](const Candidate& one) { return one.id == id; });
          if (found == candidates.end()) found = candidates.insert(found, {id, {}, 0});
          found->colour += cv::Vec3i(cells.at<cv::Vec3b>(v, u));
          ++found->cells;
        }
      }
      if (candidates.size() < 2) continue;
      for (Candidate& one : candidates) {
        for (int k = 0; k < 3; ++k) one.colour[k] /= one.cells;
      }
      const int bottom = (row + 1) * bgr.rows / ids.rows;
      const int right = (column + 1) * bgr.cols / ids.cols;
      for (int v = row * bgr.rows / ids.rows; v < bottom; ++v) {
        const auto* pixels = bgr.ptr<cv::Vec3b>(v);
        auto* to = refined.ptr<int>(v);
        for (int u = column * bgr.cols / ids.cols; u < right; ++u) {
          int least = std::numeric_limits<int>::max();
          for (const Candidate& candidate : candidates) {
            const cv::Vec3i difference = cv::Vec3i(pixels[u]) - candidate.colour;
            const int unlikeness = difference.dot(difference);
            if (unlikeness >= least) continue;
            least = unlikeness;
            to[u] = candidate.id;
          }
        }
      }
    }
  }
  return refined;
}

}  // namespace beckon
