// Ground or not, for each segment of the small picture, from motion, colour and what was thought
// before.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "services/ground_detector/colour_model.hpp"
#include "services/ground_detector/mean_shift.hpp"

namespace beckon {

struct ClassifierOptions {
  float keep = 0.35F;         // share of what motion has said that is kept from frame to frame
  float motion_limit = 5.0F;  // log-odds that motion can heap up
  // How much each kind of knowledge insists against its surroundings.
  float cell_motion_weight = 0.15F;     // for each unit of log-odds
  float segment_motion_weight = 0.02F;  // for each unit of log-odds
  float colour_weight = 0.09F;
  float near_weight = 0.04F;       // what lies directly before the robot is ground, see README,
  float near_alone_weight = 0.1F;  // above all if it is one segment and no more
  float horizon_weight = 1.0F;     // what lies above the horizon is not
};

// One frame as the classifier sees it. All pictures have the size of the segmentation.
struct SegmentScene {
  const Segmentation& segments;
  const cv::Mat& bgr;                 // CV_8UC3, mean colours
  const cv::Mat& evidence;            // CV_32FC1 as from GroundEvidence; empty without motion
  const cv::Mat& above_horizon;       // CV_8UC1, 255 where a cell reaches the horizon
  const cv::Mat& just_above_horizon;  // the lowest of these
  const cv::Mat& near;                // CV_8UC1, 255 for the cells directly before the robot
  // Where a ground cell was in the previous frame, in cells; nothing where that is not known.
  std::optional<Eigen::Matrix3d> before_from_now;
};

class SegmentClassifier {
 public:
  explicit SegmentClassifier(const ClassifierOptions& options) : options_(options) {}

  // Log-odds of ground for each cell, CV_32FC1; about 0 where nothing is known.
  cv::Mat Update(const SegmentScene& scene);

  // Forgets the previous frame, not the colours: after a gap in time.
  void Restart();

 private:
  // Mean and spread of a segment's colour.
  struct Appearance {
    cv::Vec3f mean;
    cv::Vec3f variance;
    float cells = 0.0F;
  };
  static std::vector<Appearance> Describe(const SegmentScene& scene);
  std::vector<float> MotionFromBefore(const SegmentScene& scene,
                                      const std::vector<Appearance>& appearance) const;
  void AddEvidence(const SegmentScene& scene, std::vector<float>& motion) const;
  static int NearSegment(const SegmentScene& scene);
  cv::Mat CellMotion(const SegmentScene& scene) const;
  void Learn(const SegmentScene& scene, const cv::Mat& cell_motion, const cv::Mat& log_odds);

  ClassifierOptions options_;
  ColourModel colours_;
  // The previous frame.
  cv::Mat ids_;
  std::vector<Appearance> appearance_;
  std::vector<float> motion_;  // log-odds of ground from motion alone, of each segment
  cv::Mat cell_motion_;        // and of each cell, CV_32FC1
  cv::Mat log_odds_;
  cv::Mat bgr_;
};

}  // namespace beckon
