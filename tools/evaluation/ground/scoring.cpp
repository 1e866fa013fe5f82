#include "tools/evaluation/ground/scoring.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/statistics.hpp"

namespace beckon {
namespace {

double Share(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                   : std::numeric_limits<double>::quiet_NaN();
}

RayCasterOptions FineRays() {
  RayCasterOptions options;
  // Truth has bearings of its own; at a tenth of a degree the nearest ray is as good as the same
  // one.
  options.bearing_step_deg = 0.1;
  options.max_range_m = 50.0;
  return options;
}

}  // namespace

void PixelCounts::Add(const PixelCounts& other) {
  judged += other.judged;
  ground += other.ground;
  ground_found += other.ground_found;
  obstacle_as_ground += other.obstacle_as_ground;
  undetermined += other.undetermined;
}

double PixelCounts::RegionFalseRate() const {
  return Share(ground - ground_found + obstacle_as_ground, judged);
}

PixelCounts CountPixels(const cv::Mat& labels, const cv::Mat& truth) {
  if (labels.type() != CV_8UC1 || truth.type() != CV_8UC1 || labels.size() != truth.size()) {
    throw std::invalid_argument("labels and truth have to be 8-bit pictures of the same size");
  }
  PixelCounts counts;
  for (int v = 0; v < labels.rows; ++v) {
    const auto* label = labels.ptr<std::uint8_t>(v);
    const auto* true_label = truth.ptr<std::uint8_t>(v);
    for (int u = 0; u < labels.cols; ++u) {
      if (true_label[u] == kUndetermined) continue;
      ++counts.judged;
      if (label[u] == kUndetermined) ++counts.undetermined;
      if (true_label[u] == kGround) {
        ++counts.ground;
        if (label[u] == kGround) ++counts.ground_found;
      } else if (label[u] == kGround) {
        ++counts.obstacle_as_ground;
      }
    }
  }
  return counts;
}

void CompareRanges(const VirtualScan& scan, const std::vector<float>& nearest_visible_m,
                   const std::vector<TrueRange>& truth, double max_range_m, RangeErrors& errors) {
  for (const TrueRange& expected : truth) {
    const auto ray = static_cast<std::ptrdiff_t>(
        std::lround((expected.bearing_rad - scan.first_bearing_rad) / scan.bearing_step_rad));
    if (ray < 0 || ray >= static_cast<std::ptrdiff_t>(scan.ranges_m.size())) continue;
    const auto i = static_cast<std::size_t>(ray);
    // A ray that sees no floor has NaN here, and the comparison is false.
    if (!(expected.range_m >= nearest_visible_m[i]) || expected.range_m > max_range_m) continue;
    ++errors.judged;
    const double range = scan.ranges_m[i];
    if (std::isnan(range)) {
      ++errors.undetermined;
      continue;
    }
    if (range > 1.2 * expected.range_m) ++errors.missed;
    if (range < 0.8 * expected.range_m) ++errors.phantom;
    if (std::isfinite(range)) {
      errors.relative.push_back((range - expected.range_m) / expected.range_m);
    }
  }
}

GroundScorer::GroundScorer(const Sequence& sequence, double max_range_m)
    : sequence_(sequence), max_range_m_(max_range_m), caster_(sequence.camera, FineRays()) {}

void GroundScorer::AddFeatures(const GroundFrame& frame, const cv::Mat& truth) {
  std::int64_t matched = 0;
  std::int64_t wrong = 0;
  std::int64_t undetermined = 0;
  for (const ClassifiedFeature& feature : frame.features) {
    const cv::Point pixel(cvRound(feature.pixel.x), cvRound(feature.pixel.y));
    if (!feature.matched || !cv::Rect({}, truth.size()).contains(pixel)) continue;
    const std::uint8_t expected = truth.at<std::uint8_t>(pixel);
    if (expected == kUndetermined) continue;
    ++matched;
    if (feature.feature_class == FeatureClass::kUndetermined) {
      ++undetermined;
      continue;
    }
    const bool is_ground = feature.feature_class == FeatureClass::kGround;
    if (is_ground != (expected == kGround)) ++wrong;
  }
  if (matched == 0) return;
  feature_false_rates_.push_back(Share(wrong, matched));
  feature_undetermined_.push_back(Share(undetermined, matched));
}

// A frame without an answer counts as one that says "did not move", unless a later answer reaches
// back over it.
void GroundScorer::AddMotion(std::size_t index, const GroundFrame& frame) {
  const bool answered = frame.motion.status == MotionStatus::kOk;
  std::size_t from = index == 0 ? 0 : index - 1;
  while (answered && from > 0 && sequence_.frames[from].utime > frame.motion_from) --from;
  const auto& now = sequence_.frames[index].map_from_robot;
  if (index == 0 || !now || !sequence_.frames[from].map_from_robot) return;
  motions_.resize(sequence_.frames.size());
  for (std::size_t i = from + 1; i < index; ++i) motions_[i] = {};
  const Pose2 expected = sequence_.frames[from].map_from_robot->Inverse() * *now;
  const Pose2 found = answered ? frame.motion.from_to : Pose2{};
  motions_[index] = {(found.translation() - expected.translation()).norm(),
                     expected.translation().norm(),
                     std::abs(WrapAngle(found.theta - expected.theta)), std::abs(expected.theta)};
}

void GroundScorer::Add(std::size_t index, const GroundFrame& frame, const cv::Mat& truth,
                       double decode_ms) {
  if (index < kUnjudgedFrames) return;
  ++frames_;
  if (!truth.empty()) {
    const PixelCounts counts = CountPixels(frame.labels, truth);
    pixels_.Add(counts);
    if (counts.judged > 0) region_false_rates_.push_back(counts.RegionFalseRate());
    AddFeatures(frame, truth);
  }
  CompareRanges(caster_.Cast(frame.labels, frame.pitch_rad, frame.roll_rad),
                caster_.nearest_visible_m(), sequence_.frames[index].ranges, max_range_m_, ranges_);
  AddMotion(index, frame);
  ms_.push_back(decode_ms + frame.ms.total);
  const std::pair<const char*, double> stages[] = {
      {"decode", decode_ms},           {"features", frame.ms.features},
      {"motion", frame.ms.motion},     {"segmentation", frame.ms.segmentation},
      {"parallax", frame.ms.parallax}, {"classification", frame.ms.classification},
      {"borders", frame.ms.borders}};
  for (const auto& [stage, ms] : stages) stage_ms_[stage].push_back(ms);
}

GroundScores GroundScorer::Result() const {
  GroundScores scores;
  scores.sequence = sequence_.name;
  scores.frames = frames_;
  const auto put = [&](const char* name, double value) {
    if (!std::isnan(value)) scores.values[name] = value;
  };
  put("region_false_rate_mean", Mean(region_false_rates_));
  put("region_false_rate_max", Quantile(region_false_rates_, 1.0));
  put("ground_recall", Share(pixels_.ground_found, pixels_.ground));
  put("obstacle_as_ground", Share(pixels_.obstacle_as_ground, pixels_.judged - pixels_.ground));
  put("undetermined", Share(pixels_.undetermined, pixels_.judged));
  put("feature_false_rate_mean", Mean(feature_false_rates_));
  put("feature_undetermined_mean", Mean(feature_undetermined_));
  std::vector<double> absolute = ranges_.relative;
  for (double& value : absolute) value = std::abs(value);
  put("range_error_mean", Mean(absolute));
  put("range_error_median", Quantile(absolute, 0.5));
  put("range_error_p95", Quantile(absolute, 0.95));
  put("range_error_bias", Mean(ranges_.relative));
  put("missed", Share(ranges_.missed, ranges_.judged));
  put("phantom", Share(ranges_.phantom, ranges_.judged));
  put("range_undetermined", Share(ranges_.undetermined, ranges_.judged));
  MotionError sum;
  for (const MotionError& motion : motions_) {
    sum.translation_error_m += motion.translation_error_m;
    sum.translation_m += motion.translation_m;
    sum.rotation_error_rad += motion.rotation_error_rad;
    sum.rotation_rad += motion.rotation_rad;
  }
  if (sum.translation_m > 0.0)
    put("translation_error", sum.translation_error_m / sum.translation_m);
  if (sum.rotation_rad > 0.0) put("rotation_error", sum.rotation_error_rad / sum.rotation_rad);
  put("ms_median", Quantile(ms_, 0.5));
  put("ms_p95", Quantile(ms_, 0.95));
  for (const auto& [stage, ms] : stage_ms_) scores.stage_ms[stage] = Quantile(ms, 0.5);
  return scores;
}

}  // namespace beckon
