#include "services/ground_detector/ground_odometry.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

namespace beckon {
namespace {

constexpr float kNarrowRadiusPx = 3.0F;  // around where motion says that a feature is
constexpr double kPixelSigma = 0.5;      // of a FAST corner, which has whole pixels

// Nothing for points that the homography puts behind the camera.
std::optional<Eigen::Vector2d> Apply(const Eigen::Matrix3d& homography, const cv::Point2f& pixel) {
  const Eigen::Vector3d moved = homography * Eigen::Vector3d(pixel.x, pixel.y, 1.0);
  if (moved.z() <= 1e-9) return std::nullopt;
  return Eigen::Vector2d(moved.head<2>() / moved.z());
}

// Turns (x, y, theta) by an angle about the vertical.
Eigen::Matrix3d Turn(double angle_rad) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << std::cos(angle_rad), -std::sin(angle_rad), std::sin(angle_rad),
      std::cos(angle_rad);
  return turn;
}

Pose2 Scaled(const Pose2& velocity, double seconds) {
  return {velocity.x * seconds, velocity.y * seconds, velocity.theta * seconds};
}

}  // namespace

void GroundOdometry::Restart() {
  memory_.clear();
  tracks_.clear();
  velocity_ = {};
  velocity_known_ = false;
}

FollowedFrame GroundOdometry::Follow(const std::vector<Feature>& features,
                                     const GreyPyramid& pyramid, const cv::Mat& expected_ground,
                                     Utime utime) {
  ++number_;
  FollowedFrame result;
  result.motion_from = utime;
  Pose2 pose;
  std::vector<TrackMatch> matches;
  if (!memory_.empty()) {
    const double dt_s = SecondsFromUtime(utime - memory_.back().utime);
    const Pose2 last = memory_.back().odometry_from_robot;
    const Pose2 predicted = last * Scaled(velocity_, dt_s);
    result.motion_from = memory_.back().utime;
    matches = MatchWide(features, dt_s);
    PoseEstimate estimate = LocateFrom(matches, features, predicted);
    if (estimate.status == MotionStatus::kOk) {
      matches = MatchNarrow(features, estimate.frame_from_robot);
      estimate = LocateFrom(matches, features, estimate.frame_from_robot);
    }
    if (options_.Uses(DetectorPart::kAlignment)) {
      estimate = Align(estimate, pyramid, expected_ground, dt_s);
      if (estimate.status == MotionStatus::kOk) {
        matches = MatchNarrow(features, estimate.frame_from_robot);
      }
    }
    const Pose2 motion = last.Inverse() * estimate.frame_from_robot;
    if (estimate.status == MotionStatus::kOk && !IsPossible(motion, dt_s)) {
      estimate.status = MotionStatus::kInconsistent;
    }
    result.motion.status = estimate.status;
    result.motion.inliers = estimate.inliers;
    result.located = estimate.status == MotionStatus::kOk;
    pose = result.located ? estimate.frame_from_robot : predicted;
    result.before_from_now = pose_.Inverse() * pose;
    if (result.located) {
      result.motion.from_to = motion;
      // Covariance is found in the odometry frame; the motion is told in the older robot frame.
      const Eigen::Matrix3d turn = Turn(-last.theta);
      result.motion.covariance = turn * estimate.covariance * turn.transpose();
      velocity_ = Scaled(motion, 1.0 / dt_s);
      velocity_known_ = true;
    } else {
      matches.clear();
      // Without a pose for long, or from the start: what is remembered is out of reach, and this
      // frame begins anew.
      if (!velocity_known_ || dt_s > 0.5 * options_.memory_s) {
        Restart();
        result.located = true;
      }
    }
  } else {
    result.located = true;
  }
  pose_ = pose;

  result.features.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) result.features[i].pixel = features[i].pixel;
  for (const TrackMatch& match : matches) {
    Track& track = tracks_[static_cast<std::size_t>(match.track)];
    const auto i = static_cast<std::size_t>(match.feature);
    track.feature_class = Classify(track, features[i].pixel, pose);
    track.descriptor = features[i].descriptor;
    track.seen.push_back({number_, features[i].pixel});
    result.features[i].matched = true;
    result.features[i].feature_class = track.feature_class;
  }
  // A frame that could not be located is passed over: the next one is matched with those before it.
  if (!result.located) return result;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (result.features[i].matched) continue;
    tracks_.push_back(
        {features[i].descriptor, {{number_, features[i].pixel}}, FeatureClass::kUndetermined});
  }
  memory_.push_back({number_, utime, pose, pyramid});
  Forget(utime);
  return result;
}

void GroundOdometry::Forget(Utime utime) {
  // A little more than the memory, so that a frame exactly that old counts whatever its jitter.
  const Utime oldest = utime - UtimeFromSeconds(1.05 * options_.memory_s);
  while (memory_.size() > 1 && memory_.front().utime < oldest) memory_.pop_front();
  for (Track& track : tracks_) {
    while (!track.seen.empty() && track.seen.front().frame < memory_.front().number) {
      track.seen.pop_front();
    }
  }
  std::erase_if(tracks_, [](const Track& track) { return track.seen.empty(); });
}

const RememberedFrame* GroundOdometry::Remembered(std::int64_t number) const {
  const std::int64_t index = number - memory_.front().number;
  return &memory_[static_cast<std::size_t>(index)];
}

std::vector<cv::Point2f> GroundOdometry::Predict(const Track& track, const Pose2& pose) const {
  const Observation& last = track.seen.back();
  std::vector<cv::Point2f> points;
  if (track.feature_class != FeatureClass::kNotGround) {
    const Pose2 now_from_last = pose.Inverse() * Remembered(last.frame)->odometry_from_robot;
    const auto moved = Apply(BeforeFromNow(options_.camera, now_from_last, 0.0), last.pixel);
    if (moved) points.emplace_back(static_cast<float>(moved->x()), static_cast<float>(moved->y()));
  }
  if (track.feature_class != FeatureClass::kGround) {
    cv::Point2f flow(0.0F, 0.0F);
    if (track.seen.size() > 1) {
      const Observation& before = track.seen[track.seen.size() - 2];
      flow = (last.pixel - before.pixel) / static_cast<float>(last.frame - before.frame);
    }
    points.push_back(last.pixel + flow * static_cast<float>(number_ - last.frame));
  }
  return points;
}

std::vector<TrackMatch> GroundOdometry::MatchWide(const std::vector<Feature>& features,
                                                  double dt_s) const {
  const GroundCamera& camera = options_.camera;
  // Without a velocity anything that the robot can do may have happened; with one, what it can
  // change.
  const double turn_px = camera.fx * options_.max_turn_radps * dt_s;
  const double radius = velocity_known_ ? 0.25 * turn_px : turn_px;
  const auto radius_px = static_cast<float>(std::clamp(radius, 12.0, 0.4 * camera.width));
  const Pose2 pose = memory_.back().odometry_from_robot * Scaled(velocity_, dt_s);
  return MatchTracks(
      tracks_, features,
      [&](const Track& track) {
        return SearchWindow{velocity_known_ ? Predict(track, pose)
                                            : std::vector<cv::Point2f>{track.seen.back().pixel},
                            radius_px};
      },
      kNarrowRadiusPx, options_.tracker);
}

std::vector<TrackMatch> GroundOdometry::MatchNarrow(const std::vector<Feature>& features,
                                                    const Pose2& pose) const {
  return MatchTracks(
      tracks_, features,
      [&](const Track& track) {
        const bool rises = track.feature_class == FeatureClass::kNotGround;
        return SearchWindow{Predict(track, pose), rises ? 2.5F * kNarrowRadiusPx : kNarrowRadiusPx};
      },
      kNarrowRadiusPx, options_.tracker);
}

PoseEstimate GroundOdometry::LocateFrom(const std::vector<TrackMatch>& matches,
                                        const std::vector<Feature>& features,
                                        const Pose2& predicted) const {
  const GroundCamera& camera = options_.camera;
  std::vector<GroundMatch> ground;
  for (const TrackMatch& match : matches) {
    const Track& track = tracks_[static_cast<std::size_t>(match.track)];
    if (track.feature_class == FeatureClass::kNotGround) continue;
    const cv::Point2f now = features[static_cast<std::size_t>(match.feature)].pixel;
    const auto here = camera.GroundFromPixel({now.x, now.y});
    if (!here) continue;
    // The oldest sighting has the longest way to the present one; an error of a pixel then grows
    // with the square of how much nearer the point has come.
    const Observation& seen = track.seen.front();
    const auto there = camera.GroundFromPixel({seen.pixel.x, seen.pixel.y});
    if (!there) continue;
    const double growth = std::max(there->squaredNorm() / here->squaredNorm(), 1.0);
    ground.push_back({Remembered(seen.frame)->odometry_from_robot * *there,
                      {now.x, now.y},
                      kPixelSigma * std::sqrt(1.0 + growth * growth)});
  }
  return EstimatePose(camera, ground, predicted, options_.motion);
}

// The height of what a feature shows, from how far it is from where ground would be: on a plane at
// a fifth of the camera's height it would be displaced by `lift`.
FeatureClass GroundOdometry::Classify(const Track& track, const cv::Point2f& pixel,
                                      const Pose2& pose) const {
  const GroundCamera& camera = options_.camera;
  if (pixel.y <= camera.HorizonRow(pixel.x) + 1.0) return FeatureClass::kNotGround;
  constexpr double kRatio = 0.2;
  const Observation& seen = track.seen.front();
  const Pose2 now_from_then = pose.Inverse() * Remembered(seen.frame)->odometry_from_robot;
  const auto as_ground = Apply(BeforeFromNow(camera, now_from_then, 0.0), seen.pixel);
  const auto raised = Apply(BeforeFromNow(camera, now_from_then, kRatio), seen.pixel);
  if (!as_ground || !raised) return FeatureClass::kUndetermined;
  const Eigen::Vector2d lift = *raised - *as_ground;
  const Eigen::Vector2d error = Eigen::Vector2d(pixel.x, pixel.y) - *as_ground;
  // Back-projection tolerance: two whole-pixel corners, and what the pose errs by.
  constexpr double kTolerance = 2.0;
  const double along = lift.norm() > 1e-6 ? error.dot(lift) / lift.norm() : 0.0;
  const double across = std::sqrt(std::max(error.squaredNorm() - along * along, 0.0));
  if (along > kTolerance || across > 1.5 * kTolerance) return FeatureClass::kNotGround;
  // Something a fifth of the camera's height up would have to show, or nothing is concluded.
  if (lift.norm() < 1.5 * kTolerance) return FeatureClass::kUndetermined;
  return FeatureClass::kGround;
}

// Twice the robot's limits leave room for their estimate and for a base that overshoots.
bool GroundOdometry::IsPossible(const Pose2& motion, double dt_s) const {
  return motion.translation().norm() < 2.0 * options_.max_speed_mps * dt_s &&
         std::abs(motion.theta) < 2.0 * options_.max_turn_radps * dt_s;
}

// Corners give the motion roughly whatever it is, brightness finely once it is known roughly. Where
// there are no corners to speak of, brightness is asked alone, and has to be sure of its answer.
PoseEstimate GroundOdometry::Align(const PoseEstimate& from_features, const GreyPyramid& pyramid,
                                   const cv::Mat& expected_ground, double dt_s) const {
  const RememberedFrame& last = memory_.back();
  const bool have_features = from_features.status == MotionStatus::kOk;
  const Pose2 predicted = have_features
                              ? last.odometry_from_robot.Inverse() * from_features.frame_from_robot
                              : Scaled(velocity_, dt_s);
  const Alignment alignment =
      AlignGround(options_.camera, pyramid, last.pyramid, expected_ground, predicted,
                  !have_features && !velocity_known_, options_.alignment);
  const double height = options_.camera.height_m;
  const Pose2 change = predicted.Inverse() * alignment.before_from_now;
  const double sigma_m = std::sqrt(alignment.covariance.topLeftCorner<2, 2>().trace());
  const double sigma_rad = std::sqrt(alignment.covariance(2, 2));
  const bool sure = alignment.ok && sigma_m < 0.01 * height && sigma_rad < 0.005;
  const bool near_features =
      change.translation().norm() < 0.05 * height && std::abs(change.theta) < 0.02;
  const bool possible = have_features ? near_features : IsPossible(alignment.before_from_now, dt_s);
  if (!sure || !possible) return from_features;
  PoseEstimate estimate = from_features;
  estimate.status = MotionStatus::kOk;
  estimate.frame_from_robot = last.odometry_from_robot * alignment.before_from_now;
  const Eigen::Matrix3d turn = Turn(last.odometry_from_robot.theta);
  estimate.covariance = turn * alignment.covariance * turn.transpose();
  return estimate;
}

}  // namespace beckon
