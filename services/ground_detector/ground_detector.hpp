// MonoVNS: from the pictures of one moving camera, which pixels are ground (Lin and Song, chapter
// 3).
#pragma once

#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.hpp"
#include "common/config.hpp"
#include "common/frames.hpp"
#include "common/ground_camera.hpp"
#include "common/label_runs.hpp"
#include "services/ground_detector/alignment.hpp"
#include "services/ground_detector/borders.hpp"
#include "services/ground_detector/features.hpp"
#include "services/ground_detector/mean_shift.hpp"
#include "services/ground_detector/motion.hpp"
#include "services/ground_detector/parallax.hpp"
#include "services/ground_detector/segment_classifier.hpp"
#include "services/ground_detector/tracks.hpp"

namespace beckon {

struct GroundDetectorOptions {
  GroundCamera camera;
  double max_speed_mps = 1.0;  // what the first match has to reckon with
  double max_turn_radps = 1.5;
  double memory_s = 1.0;   // frames that features are matched with and parallax is taken from
  double max_gap_s = 1.5;  // after a longer gap nothing is compared with what was before
  int scale = 10;          // frame pixels along a side of a segmentation cell
  FeatureOptions features;
  TrackerOptions tracker;
  MotionOptions motion;
  AlignmentOptions alignment;
  ParallaxOptions parallax;
  MeanShiftOptions mean_shift;
  ClassifierOptions classifier;
  BorderOptions borders;
  bool use_alignment = true;
  bool use_parallax = true;
  bool use_borders = true;  // else the labels have the borders of the segments
};

// Parts that can be left out, to see what each is good for: "alignment", "parallax", "colour",
// "history" and "borders".
const std::vector<std::string>& DetectorParts();
// Throws std::invalid_argument for a name that is not one of DetectorParts().
void LeaveOut(const std::string& part, GroundDetectorOptions& options);

// Reads [camera], [robot] and [ground_detector].
GroundDetectorOptions ReadGroundDetectorOptions(ConfigFile& file);

struct ClassifiedFeature {
  cv::Point2f pixel;  // in the frame as taken
  bool matched = false;
  FeatureClass feature_class = FeatureClass::kUndetermined;
};

// Wall time of each stage, ms. Segmentation runs beside features and motion.
struct StageTimes {
  double features = 0.0;
  double motion = 0.0;  // matching included
  double segmentation = 0.0;
  double parallax = 0.0;
  double classification = 0.0;
  double borders = 0.0;
  double total = 0.0;
};

struct GroundFrame {
  Utime utime = 0;
  cv::Mat labels;       // CV_8UC1, GroundLabel of each pixel of the frame as taken
  PlanarMotion motion;  // from the frame at motion_from to this one
  Utime motion_from = 0;
  double pitch_rad = 0.0;  // as in ground_t
  double roll_rad = 0.0;
  std::vector<ClassifiedFeature> features;
  // The small picture, in ideal pixels: its segments, what parallax says (empty without), and the
  // log-odds of ground that follow. Empty for a dark frame.
  Segmentation segments;
  cv::Mat evidence;  // CV_32FC1
  cv::Mat log_odds;  // CV_32FC1
  StageTimes ms;
};

class GroundDetector {
 public:
  explicit GroundDetector(const GroundDetectorOptions& options);

  // `bgr`: CV_8UC3 of the camera's size, std::invalid_argument otherwise. Frames come in the order
  // they were taken; one that is not newer than the last, or much newer, starts the matching afresh
  // (motion kRestart). In a frame too dark to see anything all is undetermined.
  GroundFrame Process(const cv::Mat& bgr, Utime utime);

 private:
  // What is kept of a frame.
  struct Memory {
    std::int64_t number = 0;
    Utime utime = 0;
    Pose2 odometry_from_robot;
    GreyPyramid pyramid;
  };

  void Restart();
  void Forget(Utime utime);
  const Memory* Remembered(std::int64_t number) const;
  void FollowFeatures(const std::vector<Feature>& features, const GreyPyramid& pyramid, Utime utime,
                      GroundFrame& result);
  std::vector<TrackMatch> MatchWide(const std::vector<Feature>& features, double dt_s) const;
  std::vector<TrackMatch> MatchNarrow(const std::vector<Feature>& features,
                                      const Pose2& pose) const;
  PoseEstimate LocateFrom(const std::vector<TrackMatch>& matches,
                          const std::vector<Feature>& features, const Pose2& predicted) const;
  bool IsPossible(const Pose2& motion, double dt_s) const;
  std::vector<cv::Point2f> Predict(const Track& track, const Pose2& pose) const;
  FeatureClass Classify(const Track& track, const cv::Point2f& pixel, const Pose2& pose) const;
  PoseEstimate Align(const PoseEstimate& from_features, const GreyPyramid& pyramid,
                     double dt_s) const;
  cv::Mat Evidence() const;
  cv::Mat IdealFromTaken(const cv::Mat& bgr) const;
  cv::Mat TakenFromIdeal(const cv::Mat& labels) const;

  GroundDetectorOptions options_;
  cv::Size cells_;
  cv::Mat above_horizon_;      // CV_8UC1 of cells_
  cv::Mat near_;               // CV_8UC1 of cells_
  cv::Mat not_below_horizon_;  // CV_8UC1 of the frame
  // For lenses with distortion: where each ideal pixel is in the frame as taken, and the other way
  // round.
  cv::Mat taken_from_ideal_;
  cv::Mat ideal_from_taken_;

  std::int64_t number_ = 0;
  std::deque<Memory> memory_;  // oldest first; the last one is the newest that was located
  std::vector<Track> tracks_;
  Pose2 pose_;  // odometry_from_robot of the newest frame, predicted where not located_
  bool located_ = false;
  Pose2 velocity_;  // motion per second, for prediction
  bool velocity_known_ = false;
  std::optional<Pose2> before_from_now_;  // motion of the newest frame, for the classifier
  cv::Mat expected_ground_;               // CV_8UC1 of cells_, where ground was in the last frame
  SegmentClassifier classifier_;
};

}  // namespace beckon
