#include "services/ground_detector/foot_line.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "services/ground_detector/half_size.hpp"

namespace beckon {
namespace {

constexpr int kLineStep = 3;  // half-size pixels between lines, at the horizon
constexpr std::size_t kMaxBefore = 2;

// The lines of the picture that lead to the point below the camera, in half-size pixels.
class Lines {
 public:
  Lines(const Eigen::Matrix3d& ground_from_half, const cv::Size& size) {
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

  Eigen::Vector3d nadir_;  // homogeneous: infinitely far for a camera that looks level
  double top_ = 0.0;
  double first_ = 0.0;
  double last_ = 0.0;
  int count_ = 0;
};

// How pixels of now appear in an earlier frame.
struct Warp {
  const cv::Mat* grey = nullptr;
  Eigen::Matrix3d before_from_now;  // of the ground, half-size pixels
  Eigen::Vector3f parallax;         // for what seems to be twice as far away as it is
};

struct Foot {
  int row = -1;             // by the cells: first that is not ground, from below; -1 for none
  std::vector<float> cost;  // of each row from row - reach to row + reach
};

// A pixel of a line: what it looks like, and where it would have been seen as ground.
struct LinePixel {
  bool is_inside = false;
  float grey = 0.0F;
  float scale = 1.0F;     // of a residual, grey levels
  float distance = 0.0F;  // as ground, m
  std::array<Eigen::Vector3f, kMaxBefore> seen;
};

class FootCosts {
 public:
  FootCosts(const Lines& lines, const cv::Mat& grey, const Eigen::Matrix3d& ground_from_now,
            std::span<const Warp> warps, const FootLineOptions& options)
      : lines_(lines),
        grey_(grey),
        ground_from_now_(ground_from_now),
        warps_(warps),
        options_(options) {}

  // Median cost of the ground seen in the first earlier frame, away from its borders: what the
  // motion to it is good for. Large where there is no such ground.
  float CostOfGround(const cv::Mat& ground) const {
    constexpr int kStep = 4;
    cv::Mat sure;
    cv::erode(ground, sure, cv::Mat::ones(2 * options_.reach + 1, 1, CV_8UC1));
    std::vector<float> costs;
    for (int line = 0; line < lines_.count(); line += kStep) {
      for (int row = lines_.first_row(); row + 1 < grey_.rows; row += kStep) {
        if (!IsInside(line, row) || !IsSet(sure, line, row)) continue;
        costs.push_back(CostOf(PixelOf(line, row), 0, 0.0F));
      }
    }
    if (costs.empty()) return options_.limit;
    const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2);
    std::nth_element(costs.begin(), middle, costs.end());
    return *middle;
  }

  // The foot on a line; none where the cells have none, or `where` is zero.
  Foot Of(int line, const cv::Mat& ground, const cv::Mat& where) const {
    const int first = lines_.first_row();
    int row = grey_.rows - 2;
    while (row > first && !IsInside(line, row)) --row;
    const int lowest = row;
    while (row > first && IsInside(line, row) && IsSet(ground, line, row)) --row;
    Foot foot;
    if (row == lowest || row <= first || !IsInside(line, row) || !IsSet(where, line, row)) {
      return foot;
    }
    foot.row = row;
    foot.cost.assign(static_cast<std::size_t>(2 * options_.reach + 1), 0.0F);
    const int top = std::max(row - options_.reach - options_.height, first);
    const int bottom = std::min(row + options_.reach, lowest);
    std::vector<LinePixel> pixels;
    for (int v = top; v <= bottom; ++v) pixels.push_back(PixelOf(line, v));
    for (std::size_t frame = 0; frame < warps_.size(); ++frame) {
      AddCosts(frame, pixels, top, foot);
    }
    return foot;
  }

 private:
  int ColumnOf(int line, int row) const { return cvRound(lines_.Column(line, row)); }
  bool IsInside(int line, int row) const {
    const int column = ColumnOf(line, row);
    return column >= 1 && column + 1 < grey_.cols;
  }
  bool IsSet(const cv::Mat& mask, int line, int row) const {
    return mask.at<std::uint8_t>(row, ColumnOf(line, row)) != 0;
  }

  LinePixel PixelOf(int line, int row) const {
    LinePixel pixel;
    pixel.is_inside = IsInside(line, row);
    if (!pixel.is_inside) return pixel;
    const int column = ColumnOf(line, row);
    const auto* values = grey_.ptr<std::uint8_t>(row) + column;
    const float dx = 0.5F * static_cast<float>(values[1] - values[-1]);
    const float dy = 0.5F * static_cast<float>(grey_.at<std::uint8_t>(row + 1, column) -
                                               grey_.at<std::uint8_t>(row - 1, column));
    pixel.grey = values[0];
    pixel.scale = options_.noise_grey + options_.edge_px * std::hypot(dx, dy);
    const Eigen::Vector3d here(column, row, 1.0);
    const Eigen::Vector3d point = ground_from_now_ * here;
    pixel.distance = static_cast<float>(point.head<2>().norm() / std::abs(point.z()));
    for (std::size_t frame = 0; frame < warps_.size(); ++frame) {
      pixel.seen[frame] = (warps_[frame].before_from_now * here / point.z()).cast<float>();
    }
    return pixel;
  }

  // Of a pixel that is this much farther away than the ground there, as a share of that.
  float CostOf(const LinePixel& pixel, std::size_t frame, float farther) const {
    if (!pixel.is_inside) return 0.0F;
    const Eigen::Vector3f seen = pixel.seen[frame] + farther * warps_[frame].parallax;
    float value;
    if (!(seen.z() != 0.0F) ||
        !Interpolate(*warps_[frame].grey, seen.x() / seen.z(), seen.y() / seen.z(), value)) {
      return 0.5F * options_.limit;
    }
    return std::min(std::abs(pixel.grey - value) / pixel.scale, options_.limit);
  }

  // `top`: row of the first pixel.
  void AddCosts(std::size_t frame, const std::vector<LinePixel>& pixels, int top,
                Foot& foot) const {
    // Costs as ground, summed from each row on downwards.
    std::vector<float> below(pixels.size() + 1, 0.0F);
    for (std::size_t i = pixels.size(); i-- > 0;) {
      below[i] = below[i + 1] + CostOf(pixels[i], frame, 0.0F);
    }
    const int bottom = top + static_cast<int>(pixels.size()) - 1;
    for (std::size_t state = 0; state < foot.cost.size(); ++state) {
      // The foot is the lowest row of what stands.
      const int row = std::clamp(foot.row - options_.reach + static_cast<int>(state), top, bottom);
      const auto first_ground = static_cast<std::size_t>(row + 1 - top);
      const float distance = pixels[first_ground - 1].distance;
      float cost = below[first_ground];
      if (distance > 0.0F) {
        for (std::size_t i = 0; i < first_ground; ++i) {
          cost += CostOf(pixels[i], frame, pixels[i].distance / distance - 1.0F);
        }
      }
      foot.cost[state] += options_.share * cost;
    }
  }

  const Lines& lines_;
  const cv::Mat& grey_;
  const Eigen::Matrix3d& ground_from_now_;
  std::span<const Warp> warps_;
  const FootLineOptions& options_;
};

// What the best choice of all feet up to line a costs, for each foot of its neighbour b, apart from
// the least of these. `so_far`: the same for a, without its own costs.
std::vector<float> PassOn(const Foot& a, const Foot& b, const std::vector<float>& so_far,
                          const FootLineOptions& options) {
  std::vector<float> passed(so_far.size(), 0.0F);
  if (a.row < 0 || b.row < 0) return passed;
  std::vector<float> sum(so_far.size());
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum[i] = so_far[i] + a.cost[i];
    least = std::min(least, sum[i]);
  }
  for (std::size_t j = 0; j < passed.size(); ++j) {
    float best = least + options.jump;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      const int step = std::abs((a.row + static_cast<int>(i)) - (b.row + static_cast<int>(j)));
      best = std::min(best, sum[i] + options.smoothness * static_cast<float>(step));
    }
    passed[j] = best - least;
  }
  return passed;
}

// For each line with a foot, log-odds of ground for each row from row - reach to row + reach: the
// best foot above it against the best that is not, by min-marginals over all lines.
std::vector<std::vector<float>> LogOddsOf(const std::vector<Foot>& feet,
                                          const FootLineOptions& options) {
  constexpr float kMost = 20.0F;
  const auto states = static_cast<std::size_t>(2 * options.reach + 1);
  std::vector<std::vector<float>> forwards(feet.size(), std::vector<float>(states));
  std::vector<std::vector<float>> backwards = forwards;
  for (std::size_t i = 1; i < feet.size(); ++i) {
    forwards[i] = PassOn(feet[i - 1], feet[i], forwards[i - 1], options);
  }
  for (std::size_t i = feet.size() - 1; i-- > 0;) {
    backwards[i] = PassOn(feet[i + 1], feet[i], backwards[i + 1], options);
  }
  std::vector<std::vector<float>> log_odds(feet.size());
  for (std::size_t i = 0; i < feet.size(); ++i) {
    if (feet[i].row < 0) continue;
    std::vector<float> all(states);
    for (std::size_t j = 0; j < states; ++j) {
      all[j] = feet[i].cost[j] + forwards[i][j] + backwards[i][j];
    }
    std::vector<float> after(states + 1, std::numeric_limits<float>::infinity());
    for (std::size_t j = states; j-- > 0;) after[j] = std::min(all[j], after[j + 1]);
    float above = std::numeric_limits<float>::infinity();
    for (std::size_t j = 0; j < states; ++j) {
      // Row of state j: ground if the foot is above.
      log_odds[i].push_back(std::clamp(after[j] - above, -kMost, kMost));
      above = std::min(above, all[j]);
    }
  }
  return log_odds;
}

// From the lines to the pixels between them.
cv::Mat Painted(const Lines& lines, const std::vector<Foot>& feet,
                const std::vector<std::vector<float>>& log_odds, int reach, const cv::Size& size) {
  cv::Mat result(size, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const double index = lines.Index(u, v);
      const int left = static_cast<int>(std::floor(index));
      float sum = 0.0F;
      float weight = 0.0F;
      for (int line = std::max(left, 0); line <= std::min(left + 1, lines.count() - 1); ++line) {
        const Foot& foot = feet[static_cast<std::size_t>(line)];
        const int state = v - foot.row + reach;
        if (foot.row < 0 || state < 0 || state > 2 * reach) continue;
        const auto share = static_cast<float>(1.0 - std::abs(index - line));
        weight += share;
        sum += share * log_odds[static_cast<std::size_t>(line)][static_cast<std::size_t>(state)];
      }
      if (weight > 0.5F) result.at<float>(v, u) = sum / weight;
    }
  }
  return result;
}

}  // namespace

cv::Mat FootLogOdds(const GroundCamera& camera, const PosedGrey& now,
                    std::span<const PosedGrey> before, const cv::Mat& ground, const cv::Mat& where,
                    const FootLineOptions& options) {
  CV_Assert(before.size() <= kMaxBefore);
  const cv::Mat& grey = *now.grey;
  const auto ground_from_half = [&](const BodyPose& pose) -> Eigen::Matrix3d {
    return Rocked(camera, pose.pitch_rad, pose.roll_rad).ground_from_image * FullFromHalf();
  };
  const Eigen::Matrix3d ground_from_now = ground_from_half(now.pose);
  std::vector<Warp> warps;
  for (const PosedGrey& frame : before) {
    const Pose2 motion = frame.pose.frame_from_robot.Inverse() * now.pose.frame_from_robot;
    warps.push_back(
        {frame.grey,
         FullFromHalf().inverse() * BeforeFromNow(camera, frame.pose, now.pose, 0.0) *
             FullFromHalf(),
         (ground_from_half(frame.pose).inverse() * Eigen::Vector3d(motion.x, motion.y, 0.0))
             .cast<float>()});
  }

  const Lines lines(ground_from_now, grey.size());
  std::vector<Foot> feet(static_cast<std::size_t>(lines.count()));
  std::erase_if(warps, [&](const Warp& warp) {
    return FootCosts(lines, grey, ground_from_now, {&warp, 1}, options).CostOfGround(ground) >
           options.most_of_ground;
  });
  const FootCosts costs(lines, grey, ground_from_now, warps, options);
  cv::parallel_for_(cv::Range(0, lines.count()), [&](const cv::Range& range) {
    for (int line = range.start; line < range.end; ++line) {
      feet[static_cast<std::size_t>(line)] = costs.Of(line, ground, where);
    }
  });

  return Painted(lines, feet, LogOddsOf(feet, options), options.reach, grey.size());
}

}  // namespace beckon
