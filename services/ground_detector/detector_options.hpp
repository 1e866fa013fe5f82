// What the ground detector can be told, and the parts that it consists of.
#pragma once

#include <map>
#include <set>
#include <string>

#include "common/config.hpp"
#include "common/ground_camera.hpp"
#include "common/robot_file.hpp"
#include "services/ground_detector/alignment.hpp"
#include "services/ground_detector/borders.hpp"
#include "services/ground_detector/features.hpp"
#include "services/ground_detector/foot_line.hpp"
#include "services/ground_detector/mean_shift.hpp"
#include "services/ground_detector/motion.hpp"
#include "services/ground_detector/motion_filter.hpp"
#include "services/ground_detector/parallax.hpp"
#include "services/ground_detector/segment_classifier.hpp"
#include "services/ground_detector/tracks.hpp"

namespace beckon {

// Parts that can be left out, to see what each is good for.
enum class DetectorPart {
  kAlignment,        // motion from corners alone
  kHomographyCheck,  // the motion is not compared with a free homography
  kChain,            // compared with the last frame alone, not with those of a second
  kParallax,         // labels without evidence from motion
  kColour,           // nothing learnt from colour
  kHistory,          // segments are judged by this frame's evidence alone
  kBorders           // labels have the borders of the segments
};
// By the names that tools know them by.
const std::map<std::string, DetectorPart>& DetectorParts();

struct GroundDetectorOptions {
  GroundCamera camera;
  RobotOptions robot;      // what the motion has to reckon with
  double memory_s = 1.0;   // frames that features are matched with and parallax is taken from
  double max_gap_s = 1.5;  // after a longer gap nothing is compared with what was before
  // Pitch and roll of the body are estimated. Only for bodies that do rock: the estimate drifts by
  // milliradians, which costs a level one more than it gains.
  bool body_rocks = false;
  int scale = 10;  // frame pixels along a side of a segmentation cell
  FeatureOptions features;
  TrackerOptions tracker;
  MotionOptions motion;
  MotionFilterOptions filter;
  AlignmentOptions alignment;
  ParallaxOptions parallax;
  FootLineOptions foot_line;
  MeanShiftOptions mean_shift;
  ClassifierOptions classifier;
  BorderOptions borders;
  std::set<DetectorPart> without;  // for evaluation

  bool Uses(DetectorPart part) const { return !without.contains(part); }
};

// Reads [camera], [robot] and [ground_detector].
GroundDetectorOptions ReadGroundDetectorOptions(ConfigFile& file);

}  // namespace beckon
