#include "services/ground_detector/segment_classifier.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

#include "services/ground_detector/random_walk.hpp"

namespace beckon {
namespace {

constexpr float kSure = 4.0F;    // log-odds of what is certain
constexpr float kLearnt = 1.5F;  // log-odds from which on colours are learnt
constexpr float kFaint = 0.15F;  // evidence that noise alone may give a cell
// What lies directly before the robot in a colour that ground does not have may stand there.
constexpr float kKnownColour = 0.3F;  // log-odds
constexpr float kFootStep = 4.0F;     // squared, in radii of the segmentation's kernel

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

// 255 where two pictures differ by more than noise and a little more or less light.
cv::Mat IsUnlike(const cv::Mat& a, const cv::Mat& b) {
  constexpr double kUnlike = 12.0;  // of 255, in any channel
  cv::Mat difference;
  cv::absdiff(a, b, difference);
  cv::Mat channels[3];
  cv::split(difference, channels);
  return cv::max(cv::max(channels[0], channels[1]), channels[2]) > kUnlike;
}

}  // namespace

void SegmentClassifier::Restart() {
  ids_.release();
  appearance_.clear();
  motion_.clear();
  cell_motion_.release();
  log_odds_.release();
  bgr_.release();
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

// The same for single cells, which follow the ground: what stands on it moves a little faster
// through the picture, but new evidence outweighs old before that shows.
cv::Mat SegmentClassifier::CellMotion(const SegmentScene& scene) const {
  cv::Mat motion(scene.segments.ids.size(), CV_32FC1, cv::Scalar(0.0));
  if (!cell_motion_.empty() && scene.before_from_now && cell_motion_.size() == motion.size()) {
    cv::Matx33d matrix;
    cv::eigen2cv(*scene.before_from_now, matrix);
    const auto follow = [&](const cv::Mat& before, cv::Mat& now, cv::BorderTypes border) {
      cv::warpPerspective(before, now, matrix, motion.size(),
                          cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, border);
    };
    follow(cell_motion_, motion, cv::BORDER_CONSTANT);
    if (scene.evidence.empty()) {
      // What motion has said of a place holds while the place looks the same: nobody may step in
      // and be ground for what was seen before.
      cv::Mat expected;
      follow(bgr_, expected, cv::BORDER_REPLICATE);
      motion.setTo(0.0, IsUnlike(scene.bgr, expected));
    }
  }
  if (scene.evidence.empty()) return motion;
  motion = options_.keep * motion + scene.evidence;
  cv::min(motion, options_.motion_limit, motion);
  cv::max(motion, -options_.motion_limit, motion);
  return motion;
}

// A segment gains this frame's evidence, for and against, as a share of what there is; a little of
// it says less than much. A segment whose parts contradict each other says nothing as a whole.
void SegmentClassifier::AddEvidence(const SegmentScene& scene, std::vector<float>& motion) const {
  const cv::Mat& ids = scene.segments.ids;
  const cv::Mat& modes = scene.segments.modes;
  // Where a thing stands on the ground, the edge between them moves like the ground and yet says
  // nothing of the thing above it: a skirting board would be ground for its foot alone.
  const auto is_foot = [&](int v, int u) {
    if (v + 1 >= ids.rows || ids.at<int>(v, u) == ids.at<int>(v + 1, u)) return false;
    const cv::Vec3f step = modes.at<cv::Vec3f>(v, u) - modes.at<cv::Vec3f>(v + 1, u);
    return step.dot(step) > kFootStep;
  };
  std::vector<float> sum(motion.size(), 0.0F);
  std::vector<float> absolute(motion.size(), 0.0F);
  ForEachCell(ids, [&](int v, int u, std::size_t id) {
    // The noise of a plain face favours one side by a little, which a large segment must not heap
    // up.
    const float evidence = scene.evidence.at<float>(v, u);
    const float clear = std::max(std::abs(evidence) - kFaint, 0.0F);
    if (clear == 0.0F || (evidence > 0.0F && is_foot(v, u))) return;
    sum[id] += evidence > 0.0F ? clear : -clear;
    absolute[id] += clear;
  });
  for (std::size_t id = 0; id < motion.size(); ++id) {
    motion[id] = std::clamp(options_.keep * motion[id] + sum[id] / (absolute[id] + 1.0F),
                            -options_.motion_limit, options_.motion_limit);
  }
}

// The segment that lies before the robot, if one does: most of the near cells, and none above the
// horizon. More than one, and the foot of something may be among them.
int SegmentClassifier::NearSegment(const SegmentScene& scene) {
  std::vector<int> near(static_cast<std::size_t>(scene.segments.count), 0);
  std::vector<bool> rises(near.size(), false);
  int all = 0;
  ForEachCell(scene.segments.ids, [&](int v, int u, std::size_t id) {
    if (scene.near.at<std::uint8_t>(v, u) != 0) {
      ++near[id];
      ++all;
    }
    if (scene.above_horizon.at<std::uint8_t>(v, u) != 0) rises[id] = true;
  });
  const auto most = std::max_element(near.begin(), near.end());
  const bool alone = *most > all * 3 / 4 && !rises[static_cast<std::size_t>(most - near.begin())];
  return alone ? static_cast<int>(most - near.begin()) : -1;
}

void SegmentClassifier::Learn(const SegmentScene& scene, const cv::Mat& cell_motion,
                              const cv::Mat& log_odds) {
  const bool first = !colours_.knows_ground();
  // A cell on a border shows a mixture of what is on both sides, which neither is.
  cv::Mat ground;
  cv::Mat not_ground;
  const cv::Mat around = cv::Mat::ones(3, 3, CV_8UC1);
  cv::erode(log_odds > kLearnt, ground, around);
  cv::erode(log_odds < -kLearnt, not_ground, around);
  ForEachCell(scene.segments.ids, [&](int v, int u, std::size_t) {
    const auto& colour = scene.bgr.at<cv::Vec3b>(v, u);
    const bool near = scene.near.at<std::uint8_t>(v, u) != 0;
    const float motion = cell_motion.at<float>(v, u);
    const float all = log_odds.at<float>(v, u);
    if (scene.above_horizon.at<std::uint8_t>(v, u) != 0) {
      if (scene.just_above_horizon.at<std::uint8_t>(v, u) != 0) colours_.AddNotGround(colour);
    } else if (motion < -1.0F && not_ground.at<std::uint8_t>(v, u) != 0) {
      colours_.AddNotGround(colour);
    } else if ((motion > 1.0F && ground.at<std::uint8_t>(v, u) != 0) ||
               (near && (first || all > 1.0F))) {
      colours_.AddGround(colour);
    }
  });
  colours_.EndFrame();
}

cv::Mat SegmentClassifier::Update(const SegmentScene& scene) {
  const cv::Mat& ids = scene.segments.ids;
  const std::vector<Appearance> appearance = Describe(scene);
  std::vector<float> motion = MotionFromBefore(scene, appearance);
  const cv::Mat cell_motion = CellMotion(scene);

  if (!scene.evidence.empty()) AddEvidence(scene, motion);

  // The near cells teach the first frame what ground looks like before anything is judged by it.
  // Colour does not add up over frames: it says the same each time.
  if (!colours_.knows_ground()) Learn(scene, cell_motion, cv::Mat::zeros(ids.size(), CV_32FC1));
  CellBeliefs beliefs(ids.size());
  const int near_segment = NearSegment(scene);
  ForEachCell(ids, [&](int v, int u, std::size_t id) {
    const auto add_motion = [&](float log_odds, float weight) {
      beliefs.Add(v, u, log_odds < 0.0F ? -kSure : kSure, weight * std::abs(log_odds));
    };
    add_motion(cell_motion.at<float>(v, u), options_.cell_motion_weight);
    add_motion(motion[id], options_.segment_motion_weight);
    // Colour has its say where motion is silent.
    const float colour = colours_.LogRatio(scene.bgr.at<cv::Vec3b>(v, u));
    beliefs.Add(v, u, colour,
                options_.colour_weight / (1.0F + std::abs(cell_motion.at<float>(v, u))));
    if (scene.near.at<std::uint8_t>(v, u) != 0 && colour > kKnownColour) {
      beliefs.Add(
          v, u, kSure,
          static_cast<int>(id) == near_segment ? options_.near_alone_weight : options_.near_weight);
    }
    if (scene.above_horizon.at<std::uint8_t>(v, u) != 0) {
      beliefs.Add(v, u, -kSure, options_.horizon_weight);
    }
  });
  const cv::Mat log_odds =
      SpreadBeliefs(beliefs, scene.segments.colours, scene.segments.modes, log_odds_);
  Learn(scene, cell_motion, log_odds);
  ids_ = ids;
  bgr_ = scene.bgr;
  appearance_ = appearance;
  motion_ = motion;
  cell_motion_ = cell_motion;
  log_odds_ = log_odds;
  return log_odds;
}

}  // namespace beckon
