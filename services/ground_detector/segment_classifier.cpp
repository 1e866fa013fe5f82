#include "services/ground_detector/segment_classifier.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

template <typename Visit>
void ForEachCell(const cv::Mat& ids, const Visit& visit) {
  for (int v = 0; v < ids.rows; ++v) {
    const int* row = ids.ptr<int>(v);
    for (int u = 0; u < ids.cols; ++u) visit(v, u, static_cast<std::size_t>(row[u]));
  }
}

// Bhattacharyya coefficient of two normal distributions with diagonal covariances.
float Bhattacharyya(const cv::Vec3f& mean_a, const cv::Vec3f& variance_a, const cv::Vec3f& mean_b,
                    const cv::Vec3f& variance_b) {
  float distance = 0.0F;
  for (int i = 0; i < 3; ++i) {
    const float variance = 0.5F * (variance_a[i] + variance_b[i]);
    const float difference = mean_a[i] - mean_b[i];
    distance += 0.125F * difference * difference / variance +
                0.5F * std::log(variance / std::sqrt(variance_a[i] * variance_b[i]));
  }
  return std::exp(-distance);
}

}  // namespace

void SegmentClassifier::Restart() {
  ids_.release();
  appearance_.clear();
  motion_.clear();
}

std::vector<SegmentClassifier::Appearance> SegmentClassifier::Describe(const SegmentScene& scene) {
  std::vector<Appearance> appearance(static_cast<std::size_t>(scene.segments.count));
  ForEachCell(scene.segments.ids, [&](int v, int u, std::size_t id) {
    const cv::Vec3f colour = scene.bgr.at<cv::Vec3b>(v, u);
    appearance[id].mean += colour;
    appearance[id].variance += colour.mul(colour);
    appearance[id].cells += 1.0F;
  });
  constexpr float kLeastVariance = 16.0F;  // sensor noise and shading
  for (Appearance& segment : appearance) {
    segment.mean *= 1.0F / segment.cells;
    segment.variance *= 1.0F / segment.cells;
    segment.variance -= segment.mean.mul(segment.mean);
    for (int i = 0; i < 3; ++i) segment.variance[i] = std::max(segment.variance[i], kLeastVariance);
  }
  return appearance;
}

// A segment inherits from the segments that lay where it would have been, by how much they overlap
// and how alike they look. What nothing matches starts anew, at 0.
std::vector<float> SegmentClassifier::MotionFromBefore(
    const SegmentScene& scene, const std::vector<Appearance>& appearance) const {
  std::vector<float> motion(appearance.size(), 0.0F);
  if (ids_.empty() || !scene.before_from_now || ids_.size() != scene.segments.ids.size()) {
    return motion;
  }
  std::vector<float> weights(appearance.size(), 0.0F);
  ForEachCell(scene.segments.ids, [&](int v, int u, std::size_t id) {
    Eigen::Vector3d before(u, v, 1.0);
    // The ground's motion says nothing above the horizon; what is there moves little.
    if (scene.above_horizon.at<std::uint8_t>(v, u) == 0) before = *scene.before_from_now * before;
    const auto column = static_cast<int>(std::lround(before.x() / before.z()));
    const auto row = static_cast<int>(std::lround(before.y() / before.z()));
    if (column < 0 || row < 0 || column >= ids_.cols || row >= ids_.rows) return;
    const auto other = static_cast<std::size_t>(ids_.at<int>(row, column));
    const float weight = Bhattacharyya(appearance[id].mean, appearance[id].variance,
                                       appearance_[other].mean, appearance_[other].variance);
    weights[id] += weight;
    motion[id] += weight * motion_[other];
  });
  for (std::size_t id = 0; id < motion.size(); ++id) {
    constexpr float kUnmatched = 0.1F;  // share of the cells
    motion[id] = weights[id] > kUnmatched * appearance[id].cells ? motion[id] / weights[id] : 0.0F;
  }
  return motion;
}

void SegmentClassifier::Learn(const SegmentScene& scene, const std::vector<float>& motion,
                              const cv::Mat& log_odds) {
  const bool first = !colours_.knows_ground();
  ForEachCell(scene.segments.ids, [&](int v, int u, std::size_t id) {
    const auto& colour = scene.bgr.at<cv::Vec3b>(v, u);
    const bool near = scene.near.at<std::uint8_t>(v, u) != 0;
    if (scene.above_horizon.at<std::uint8_t>(v, u) != 0 || motion[id] < -1.5F) {
      colours_.AddNotGround(colour);
    } else if (motion[id] > 1.5F || (near && (first || log_odds.at<float>(v, u) > 1.0F))) {
      colours_.AddGround(colour);
    }
  });
  colours_.EndFrame();
}

cv::Mat SegmentClassifier::Update(const SegmentScene& scene) {
  const cv::Mat& ids = scene.segments.ids;
  const std::vector<Appearance> appearance = Describe(scene);
  std::vector<float> motion = MotionFromBefore(scene, appearance);

  // Motion: this frame's evidence, for and against, as a share of what there is; a little of it
  // says less than much.
  if (!scene.evidence.empty()) {
    std::vector<float> sum(motion.size(), 0.0F);
    std::vector<float> absolute(motion.size(), 0.0F);
    ForEachCell(ids, [&](int v, int u, std::size_t id) {
      sum[id] += scene.evidence.at<float>(v, u);
      absolute[id] += std::abs(scene.evidence.at<float>(v, u));
    });
    for (std::size_t id = 0; id < motion.size(); ++id) {
      motion[id] = std::clamp(
          options_.keep * motion[id] + options_.motion_gain * sum[id] / (absolute[id] + 1.0F),
          -options_.motion_limit, options_.motion_limit);
    }
  }

  // Colour does not add up over frames: it says the same each time. The near cells teach the first
  // frame what ground looks like before anything is judged by it.
  if (!colours_.knows_ground()) {
    Learn(scene, motion, cv::Mat(ids.size(), CV_32FC1, cv::Scalar(0.0)));
  }
  std::vector<float> colour(motion.size(), 0.0F);
  std::vector<float> above(motion.size(), 0.0F);
  std::vector<float> near(motion.size(), 0.0F);
  ForEachCell(ids, [&](int v, int u, std::size_t id) {
    colour[id] += colours_.LogRatio(scene.bgr.at<cv::Vec3b>(v, u)) / appearance[id].cells;
    above[id] += scene.above_horizon.at<std::uint8_t>(v, u) != 0 ? 1.0F : 0.0F;
    near[id] += scene.near.at<std::uint8_t>(v, u) != 0 ? 1.0F : 0.0F;
  });

  std::vector<float> segment_log_odds(motion.size());
  for (std::size_t id = 0; id < motion.size(); ++id) {
    float value = motion[id] + options_.colour_weight * colour[id];
    value += options_.near_bonus * near[id] / appearance[id].cells;
    // Ground ends at the horizon; a segment of which much is above it rises from the ground.
    if (above[id] > 0.15F * appearance[id].cells) value -= 4.0F;
    segment_log_odds[id] = value;
  }
  cv::Mat log_odds(ids.size(), CV_32FC1);
  ForEachCell(
      ids, [&](int v, int u, std::size_t id) { log_odds.at<float>(v, u) = segment_log_odds[id]; });
  Learn(scene, motion, log_odds);
  ids_ = ids;
  appearance_ = appearance;
  motion_ = motion;
  return log_odds;
}

}  // namespace beckon
