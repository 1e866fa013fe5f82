// How well the ground was found, by the rules of the sequence format.
#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "services/ground_detector/ground_detector.hpp"
#include "services/range_caster/ray_caster.hpp"
#include "tools/evaluation/ground/sequence.hpp"

namespace beckon {

// Frames that only start the matching and are not judged.
inline constexpr std::size_t kUnjudgedFrames = 3;

// Pixels of one frame or of many.
struct PixelCounts {
  std::int64_t judged = 0;
  std::int64_t ground = 0;              // by truth
  std::int64_t ground_found = 0;        // of these, called ground
  std::int64_t obstacle_as_ground = 0;  // not ground by truth, called ground
  std::int64_t undetermined = 0;        // judged, but called neither

  void Add(const PixelCounts& other);
  double RegionFalseRate() const;
};

// `labels`: GroundLabel; `truth`: 0 not judged, 1 ground, 2 not ground; CV_8UC1 of the same size.
PixelCounts CountPixels(const cv::Mat& labels, const cv::Mat& truth);

// Range against truth over many frames.
struct RangeErrors {
  std::vector<double> relative;  // signed, (r - r_true) / r_true, where the scan has a finite range
  std::int64_t judged = 0;       // bearings
  std::int64_t missed = 0;       // scan more than 20 % longer, or nothing met
  std::int64_t phantom = 0;      // more than 20 % shorter
  std::int64_t undetermined = 0;  // NaN
};

// Takes the ray nearest to each bearing of truth. Judged are true ranges from `nearest_visible_m`
// (of each ray of the scan) to `max_range_m`.
void CompareRanges(const VirtualScan& scan, const std::vector<float>& nearest_visible_m,
                   const std::vector<TrueRange>& truth, double max_range_m, RangeErrors& errors);

// Of the motion that ends with one frame.
struct MotionError {
  double translation_error_m = 0.0;
  double translation_m = 0.0;
  double rotation_error_rad = 0.0;
  double rotation_rad = 0.0;
};

// Scores of one sequence, by the names of the format.
struct GroundScores {
  std::string sequence;
  std::size_t frames = 0;  // judged
  std::map<std::string, double>
      values;  // a score that does not apply (no poses, no ranges) is not there
  std::map<std::string, double> stage_ms;  // median of each stage
};

// Collects frame after frame.
class GroundScorer {
 public:
  GroundScorer(const Sequence& sequence, double max_range_m);

  // `truth`: empty where the frame has none. `decode_ms` belongs to the whole pipeline.
  void Add(std::size_t index, const GroundFrame& frame, const cv::Mat& truth, double decode_ms);
  GroundScores Result() const;

 private:
  void AddFeatures(const GroundFrame& frame, const cv::Mat& truth);
  void AddMotion(std::size_t index, const GroundFrame& frame);

  const Sequence& sequence_;
  double max_range_m_;
  RayCaster caster_;
  std::size_t frames_ = 0;
  PixelCounts pixels_;
  std::vector<double> region_false_rates_;
  std::vector<double> feature_false_rates_;
  std::vector<double> feature_undetermined_;
  RangeErrors ranges_;
  std::vector<MotionError> motions_;  // by frame
  std::vector<double> ms_;
  std::map<std::string, std::vector<double>> stage_ms_;
};

}  // namespace beckon
