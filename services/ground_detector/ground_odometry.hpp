// Visual odometry over the ground: features followed from frame to frame, the planar motion that
// explains them, and which of them lie on the ground.
#pragma once

#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/clock.hpp"
#include "common/frames.hpp"
#include "services/ground_detector/alignment.hpp"
#include "services/ground_detector/detector_options.hpp"
#include "services/ground_detector/features.hpp"
#include "services/ground_detector/motion.hpp"
#include "services/ground_detector/tracks.hpp"

namespace beckon {

// A frame whose place is known.
struct RememberedFrame {
  std::int64_t number = 0;
  Utime utime = 0;
  Pose2 odometry_from_robot;
  GreyPyramid pyramid;
};

struct ClassifiedFeature {
  cv::Point2f pixel;
  bool matched = false;
  FeatureClass feature_class = FeatureClass::kUndetermined;
};

struct FollowedFrame {
  PlanarMotion motion;  // from the frame at motion_from to this one
  Utime motion_from = 0;
  bool located = false;  // the frame has joined memory()
  // Pose of this frame in the robot frame of the one before, predicted where motion is not known;
  // nothing when there was none before.
  std::optional<Pose2> before_from_now;
  std::vector<ClassifiedFeature> features;  // in ideal pixels
};

class GroundOdometry {
 public:
  explicit GroundOdometry(const GroundDetectorOptions& options) : options_(options) {}

  // The next frame, newer than the last. `expected_ground`: CV_8UC1 grid over the picture, 255
  // where ground is expected; empty in the first frame.
  FollowedFrame Follow(const std::vector<Feature>& features, const GreyPyramid& pyramid,
                       const cv::Mat& expected_ground, Utime utime);

  // Forgets all frames.
  void Restart();

  // Frames of the last memory_s, oldest first.
  const std::deque<RememberedFrame>& memory() const { return memory_; }

 private:
  void Forget(Utime utime);
  const RememberedFrame* Remembered(std::int64_t number) const;
  std::vector<TrackMatch> MatchWide(const std::vector<Feature>& features, double dt_s) const;
  std::vector<TrackMatch> MatchNarrow(const std::vector<Feature>& features,
                                      const Pose2& pose) const;
  PoseEstimate LocateFrom(const std::vector<TrackMatch>& matches,
                          const std::vector<Feature>& features, const Pose2& predicted) const;
  bool IsPossible(const Pose2& motion, double dt_s) const;
  std::vector<cv::Point2f> Predict(const Track& track, const Pose2& pose) const;
  FeatureClass Classify(const Track& track, const cv::Point2f& pixel, const Pose2& pose) const;
  PoseEstimate Align(const PoseEstimate& from_features, const GreyPyramid& pyramid,
                     const cv::Mat& expected_ground, double dt_s) const;

  GroundDetectorOptions options_;
  std::int64_t number_ = 0;
  std::deque<RememberedFrame> memory_;  // the last one is the newest that was located
  std::vector<Track> tracks_;
  Pose2 pose_;      // odometry_from_robot of the newest frame, predicted where not located
  Pose2 velocity_;  // motion per second, for prediction
  bool velocity_known_ = false;
};

}  // namespace beckon
