#include "services/ground_detector/foot_line.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <vector>

namespace beckon {
namespace {

constexpr int kLineStep = 2;  // half-size pixels between lines, at the horizon

Eigen::Matrix3d FullFromHalf() {
  // The centre of the first half-size pixel is at 0.5.
  Eigen::Matrix3d full_from_half;
  full_from_half << 2.0, 0.0, 0.5, 0.0, 2.0, 0.5, 0.0, 0.0, 1.0;
  return full_from_half;
}

bool Interpolate(const cv::Mat& grey, float u, float v, float& value) {
  if (!(u >= 0.0F && v >= 0.0F)) return false;
  const int column = static_cast<int>(u);
  const int row = static_cast<int>(v);
  if (column + 1 >= grey.cols || row + 1 >= grey.rows) return false;
  const float a = u - static_cast<float>(column);
  const float b = v - static_cast<float>(row);
  const auto* upper = grey.ptr<std::uint8_t>(row) + column;
  const auto* lower = grey.ptr<std::uint8_t>(row + 1) + column;
  const float top = upper[0] + a * static_cast<float>(upper[1] - upper[0]);
  const float bottom = lower[0] + a * static_cast<float>(lower[1] - lower[0]);
  value = top + b * (bottom - top);
  return true;
}

// The lines of the picture that lead to the point below the camera, in half-size pixels.
class Lines {
 public:
  Lines(const Eigen::Matrix3d& ground_from_half, const cv::Size& size) : size_(size) {
    nadir_ = ground_from_half.inverse().col(2);
    const Eigen::RowVector3d horizon = ground_from_half.row(2);
    // Rows of the horizon at both ends.
    top_ = -1.0;
    for (const double u : {0.0, size.width - 1.0}) {
      top_ = std::max(top_, -(horizon(0) * u + horizon(2)) / horizon(1));
    }
    first_ = std::numeric_limits<double>::infinity();
    last_ = -first_;
    for (const double u : {0.0, size.width - 1.0}) {
      for (const double v : {top_, size.height - 1.0}) {
        first_ = std::min(first_, Start(u, v));
        last_ = std::max(last_, Start(u, v));
      }
    }
    count_ = static_cast<int>((last_ - first_) / kLineStep) + 1;
  }

  int count() const { return count_; }
  int first_row() const { return std::max(static_cast<int>(top_) + 3, 1); }
  // Column of a line in a row.
  double Column(int line, int row) const {
    const double start = first_ + kLineStep * line;
    return start + Slope(start, top_) * (row - top_);
  }
  // Index of the line through a pixel, with fraction.
  double Index(double u, double v) const { return (Start(u, v) - first_) / kLineStep; }

 private:
  double Slope(double u, double v) const {
    return (nadir_.x() - u * nadir_.z()) / (nadir_.y() - v * nadir_.z());
  }
  // Where the line through a pixel starts, at the row of the horizon.
  double Start(double u, double v) const { return u + Slope(u, v) * (top_ - v); }

  cv::Size size_;
  Eigen::Vector3d nadir_;  // homogeneous: infinitely far for a camera that looks level
  double top_ = 0.0;
  double first_ = 0.0;
  double last_ = 0.0;
  int count_ = 0;
};

// How pixels of now appear in an earlier frame.
struct Warp {
  const cv::Mat* grey = nullptr;
  Eigen::Matrix3d half_before_from_ground;  // of now
  Eigen::Vector3f parallax;                 // for what seems to be twice as far away as it is
};

struct Foot {
  int row = -1;             // by the cells: first that is not ground, from below; -1 for none
  std::vector<float> cost;  // of each row from row - reach to row + reach
};

}  // namespace

cv::Mat FootLogOdds(const GroundCamera& camera, const PosedGrey& now,
                    std::span<const PosedGrey> before, const cv::Mat& ground,
                    const FootLineOptions& options) {
  const cv::Mat& grey = *now.grey;
  const auto ground_from_half = [&](const BodyPose& pose) -> Eigen::Matrix3d {
    return Rocked(camera, pose.pitch_rad, pose.roll_rad).ground_from_image * FullFromHalf();
  };
  const Eigen::Matrix3d ground_from_now = ground_from_half(now.pose);
  std::vector<Warp> warps;
  for (const PosedGrey& frame : before) {
    const Pose2 motion = frame.pose.frame_from_robot.Inverse() * now.pose.frame_from_robot;
    const double c = std::cos(motion.theta);
    const double s = std::sin(motion.theta);
    Eigen::Matrix3d rigid;
    rigid << c, -s, motion.x, s, c, motion.y, 0.0, 0.0, 1.0;
    const Eigen::Matrix3d half_from_ground = ground_from_half(frame.pose).inverse();
    warps.push_back({frame.grey, half_from_ground * rigid,
                     (half_from_ground * Eigen::Vector3d(motion.x, motion.y, 0.0)).cast<float>()});
  }

  const Lines lines(ground_from_now, grey.size());
  const int reach = options.reach;
  const int states = 2 * reach + 1;
  std::vector<Foot> feet(static_cast<std::size_t>(lines.count()));
  cv::parallel_for_(cv::Range(0, lines.count()), [&](const cv::Range& range) {
    struct Pixel {
      float grey;
      float scale;                        // of a residual, grey levels
      float distance;                     // as ground, m
      std::vector<Eigen::Vector3f> seen;  // in each earlier frame, as ground
    };
    std::vector<Pixel> pixels;
    for (int line = range.start; line < range.end; ++line) {
      Foot& foot = feet[static_cast<std::size_t>(line)];
      const auto column_at = [&](int v) { return cvRound(lines.Column(line, v)); };
      const auto inside = [&](int v) {
        const int u = column_at(v);
        return u >= 1 && u + 1 < grey.cols;
      };
      int v = grey.rows - 2;
      while (v > lines.first_row() && !inside(v)) --v;
      const int lowest = v;
      while (v > lines.first_row() && inside(v) && ground.at<std::uint8_t>(v, column_at(v)) != 0) {
        --v;
      }
      if (v == lowest || v <= lines.first_row() || !inside(v)) continue;
      foot.row = v;
      const int top = std::max(v - reach - options.height, lines.first_row());
      const int bottom = std::min(v + reach, lowest);
      foot.cost.assign(static_cast<std::size_t>(states), 0.0F);
      pixels.clear();
      for (int row = top; row <= bottom; ++row) {
        const int u = column_at(row);
        Pixel pixel{};
        if (!inside(row)) {
          pixels.push_back(pixel);
          continue;
        }
        const auto* values = grey.ptr<std::uint8_t>(row) + u;
        const float dx = 0.5F * static_cast<float>(values[1] - values[-1]);
        const float dy = 0.5F * static_cast<float>(grey.at<std::uint8_t>(row + 1, u) -
                                                   grey.at<std::uint8_t>(row - 1, u));
        pixel.grey = values[0];
        pixel.scale = options.noise_grey + options.edge_px * std::hypot(dx, dy);
        const Eigen::Vector3d point = ground_from_now * Eigen::Vector3d(u, row, 1.0);
        pixel.distance = static_cast<float>(point.head<2>().norm() / std::abs(point.z()));
        for (const Warp& warp : warps) {
          pixel.seen.push_back((warp.half_before_from_ground * point / point.z()).cast<float>());
        }
        pixels.push_back(std::move(pixel));
      }
      for (std::size_t w = 0; w < warps.size(); ++w) {
        const Warp& warp = warps[w];
        const auto cost_of = [&](const Pixel& pixel, float farther) {
          const Eigen::Vector3f seen = pixel.seen[w] + farther * warp.parallax;
          float value;
          if (!(seen.z() != 0.0F) ||
              !Interpolate(*warp.grey, seen.x() / seen.z(), seen.y() / seen.z(), value)) {
            return 0.5F * options.limit;
          }
          return std::min(std::abs(pixel.grey - value) / pixel.scale, options.limit);
        };
        // Costs as ground, summed from the row on downwards.
        std::vector<float> below(pixels.size() + 1, 0.0F);
        for (std::size_t i = pixels.size(); i-- > 0;) {
          below[i] = below[i + 1] + (pixels[i].seen.empty() ? 0.0F : cost_of(pixels[i], 0.0F));
        }
        for (int state = 0; state < states; ++state) {
          // The foot is the lowest row of what stands.
          const int row = std::clamp(v - reach + state, top, bottom);
          const auto first_ground = static_cast<std::size_t>(row + 1 - top);
          const float distance = pixels[first_ground - 1].distance;
          float cost = below[first_ground];
          if (distance > 0.0F) {
            for (std::size_t i = 0; i < first_ground; ++i) {
              if (pixels[i].seen.empty()) continue;
              cost += cost_of(pixels[i], pixels[i].distance / distance - 1.0F);
            }
          }
          foot.cost[static_cast<std::size_t>(state)] += options.share * cost;
        }
      }
    }
  });

  // Min-marginals over the lines: what the best choice of all feet costs, for each foot of each.
  const auto pass = [&](int from, int to, const std::vector<float>& messages) {
    const Foot& a = feet[static_cast<std::size_t>(from)];
    const Foot& b = feet[static_cast<std::size_t>(to)];
    std::vector<float> passed(static_cast<std::size_t>(states), 0.0F);
    if (a.row < 0 || b.row < 0) return passed;
    std::vector<float> sum(passed.size());
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] = messages[i] + a.cost[i];
      least = std::min(least, sum[i]);
    }
    for (int j = 0; j < states; ++j) {
      float best = least + options.jump;
      for (int i = 0; i < states; ++i) {
        const int step = std::abs((a.row + i) - (b.row + j));
        best = std::min(
            best, sum[static_cast<std::size_t>(i)] + options.smoothness * static_cast<float>(step));
      }
      passed[static_cast<std::size_t>(j)] = best - least;
    }
    return passed;
  };
  std::vector<std::vector<float>> forwards(feet.size(),
                                           std::vector<float>(static_cast<std::size_t>(states)));
  std::vector<std::vector<float>> backwards = forwards;
  for (int i = 1; i < lines.count(); ++i) {
    const auto to = static_cast<std::size_t>(i);
    forwards[to] = pass(i - 1, i, forwards[to - 1]);
  }
  for (int i = lines.count() - 2; i >= 0; --i) {
    const auto to = static_cast<std::size_t>(i);
    backwards[to] = pass(i + 1, i, backwards[to + 1]);
  }

  // Log-odds of ground for each row from the topmost foot on: the best foot above it against the
  // best that is not.
  std::vector<std::vector<float>> log_odds(feet.size());
  for (std::size_t i = 0; i < feet.size(); ++i) {
    if (feet[i].row < 0) continue;
    std::vector<float> all(static_cast<std::size_t>(states));
    for (std::size_t j = 0; j < all.size(); ++j) {
      all[j] = feet[i].cost[j] + forwards[i][j] + backwards[i][j];
    }
    std::vector<float> after(all.size() + 1, std::numeric_limits<float>::infinity());
    for (std::size_t j = all.size(); j-- > 0;) after[j] = std::min(all[j], after[j + 1]);
    float above = std::numeric_limits<float>::infinity();
    for (std::size_t j = 0; j < all.size(); ++j) {
      // Row of state j: ground if the foot is above.
      log_odds[i].push_back(std::clamp(after[j] - above, -20.0F, 20.0F));
      above = std::min(above, all[j]);
    }
  }
  cv::Mat result(grey.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  for (int v = 0; v < grey.rows; ++v) {
    for (int u = 0; u < grey.cols; ++u) {
      const double index = lines.Index(u, v);
      const int left = static_cast<int>(std::floor(index));
      float sum = 0.0F;
      float weight = 0.0F;
      for (int line = std::max(left, 0); line <= std::min(left + 1, lines.count() - 1); ++line) {
        const Foot& foot = feet[static_cast<std::size_t>(line)];
        const int state = v - foot.row + reach;
        if (foot.row < 0 || state < 0 || state >= states) continue;
        const auto share = static_cast<float>(1.0 - std::abs(index - line));
        weight += share;
        sum += share * log_odds[static_cast<std::size_t>(line)][static_cast<std::size_t>(state)];
      }
      if (weight > 0.5F) result.at<float>(v, u) = sum / weight;
    }
  }
  return result;
}

}  // namespace beckon
