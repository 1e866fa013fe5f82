// MonoVNS: from the pictures of one moving camera, which pixels are ground (Lin and Song, chapter
// 3).
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/clock.hpp"
#include "common/frames.hpp"
#include "common/label_runs.hpp"
#include "services/ground_detector/detector_options.hpp"
#include "services/ground_detector/ground_odometry.hpp"
#include "services/ground_detector/mean_shift.hpp"
#include "services/ground_detector/segment_classifier.hpp"
#include "services/ground_detector/view_geometry.hpp"

namespace beckon {

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
  HomographyCheck check;                    // of the motion
  std::vector<ClassifiedFeature> features;  // in pixels of the frame as taken
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
  void Restart();
  std::vector<const RememberedFrame*> EarlierFrames() const;
  cv::Mat Evidence() const;
  cv::Mat Feet(const cv::Mat& ground, const cv::Mat& where) const;
  void SettleFeatures(const cv::Mat& labels, std::vector<ClassifiedFeature>& features) const;

  GroundDetectorOptions options_;
  ViewGeometry view_;
  GroundOdometry odometry_;
  SegmentClassifier classifier_;
};

}  // namespace beckon
