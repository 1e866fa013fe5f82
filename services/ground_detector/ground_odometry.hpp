// Visual odometry over the ground: features followed from frame to frame, the motion of the body
// that explains them, and which of them lie on the ground.
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
#include "services/ground_detector/motion_filter.hpp"
#include "services/ground_detector/tracks.hpp"

namespace beckon {

// A frame whose place is known; poses in the odometry frame.
struct RememberedFrame {
  Utime utime = 0;
  BodyPose pose;
  GreyPyramid pyramid;
  GroundTexture texture;  // of keyframes, once their labels are known
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
  // Of this frame and of the one before (nothing when there is none), in the odometry frame;
  // predicted where motion is not known.
  BodyPose pose;
  std::optional<BodyPose> pose_before;
  std::vector<ClassifiedFeature> features;  // in ideal pixels
  HomographyCheck check;
};

class GroundOdometry {
 public:
  explicit GroundOdometry(const GroundDetectorOptions& options);

  // The next frame, newer than the last.
  FollowedFrame Follow(const std::vector<Feature>& features, const GreyPyramid& pyramid,
                       Utime utime);
  // What has been found in the frame just followed: GroundLabel of each ideal pixel, CV_8UC1.
  void LearnGround(const cv::Mat& labels);

  // Forgets all frames.
  void Restart();

  // Frames of the last memory_s, oldest first.
  const std::deque<RememberedFrame>& memory() const { return memory_; }

 private:
  PoseEstimate Locate(const std::vector<Feature>& features, const GreyPyramid& pyramid, double dt_s,
                      std::vector<TrackMatch>& matches) const;
  std::vector<TrackMatch> MatchWide(const std::vector<Feature>& features, const BodyPose& predicted,
                                    double dt_s) const;
  std::vector<TrackMatch> MatchNarrow(const std::vector<Feature>& features,
                                      const BodyPose& pose) const;
  PoseEstimate LocateFrom(const std::vector<TrackMatch>& matches,
                          const std::vector<Feature>& features, const MotionPrior& prior) const;
  PoseEstimate Align(const PoseEstimate& from_features, const MotionPrior& prior,
                     const GreyPyramid& pyramid, double dt_s) const;
  std::vector<AlignmentReference> References() const;
  const RememberedFrame* NewestKeyframe() const;
  HomographyCheck Check(const std::vector<TrackMatch>& matches,
                        const std::vector<Feature>& features, const BodyPose& pose) const;
  bool IsPossible(const Pose2& motion, double dt_s) const;
  void AddToTracks(const std::vector<Feature>& features, const std::vector<TrackMatch>& matches,
                   FollowedFrame& result);
  void Forget(Utime utime);

  GroundDetectorOptions options_;
  MotionFilter filter_;
  std::deque<RememberedFrame> memory_;  // the last one is the newest that was located
  std::vector<Track> tracks_;
  std::optional<BodyPose> pose_;  // of the newest frame, predicted where not located
  bool labels_awaited_ = false;   // the newest frame was located
  Utime utime_ = 0;               // of the newest frame
};

}  // namespace beckon
