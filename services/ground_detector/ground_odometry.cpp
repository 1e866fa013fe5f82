#include "services/ground_detector/ground_odometry.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "services/ground_detector/projection.hpp"

namespace beckon {
namespace {

constexpr float kNarrowRadiusPx = 3.0F;  // around where motion says that a feature is
constexpr double kPixelSigma = 0.5;      // of a FAST corner, which has whole pixels
constexpr double kShownLeanRad = 0.003;  // standard deviation from features alone
constexpr double kAnyLeanRad = 0.02;
constexpr double kCheckTolerancePx = 2.0;
constexpr double kSpeedsTried[] = {-0.5, 0.25, 0.5, 0.75, 1.0};  // over the greatest

// Where features of earlier frames are to be seen from a pose.
class Prediction {
 public:
  Prediction(const GroundCamera& camera, const BodyPose& pose, Utime utime)
      : project_(Rocked(camera, pose.pitch_rad, pose.roll_rad)),
        robot_from_odometry_(pose.frame_from_robot.Inverse()),
        utime_(utime) {}

  // As ground and as what keeps its way through the picture, as far as its class leaves that open.
  std::vector<cv::Point2f> operator()(const Track& track) const {
    const Observation& last = track.seen.back();
    std::vector<cv::Point2f> points;
    if (track.feature_class != FeatureClass::kNotGround && last.point) {
      Eigen::Vector2d pixel;
      if (project_(robot_from_odometry_ * *last.point, pixel)) {
        points.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
      }
    }
    if (track.feature_class != FeatureClass::kGround) {
      cv::Point2f flow(0.0F, 0.0F);
      if (track.seen.size() > 1) {
        const Observation& before = track.seen[track.seen.size() - 2];
        const auto share =
            static_cast<float>(utime_ - last.utime) / static_cast<float>(last.utime - before.utime);
        flow = (last.pixel - before.pixel) * share;
      }
      points.push_back(last.pixel + flow);
    }
    return points;
  }

 private:
  GroundProjection project_;
  Pose2 robot_from_odometry_;
  Utime utime_;
};

// The height of what a feature shows, from how far it is from where ground would be: on a plane at
// a fifth of the camera's height it would be displaced by `lift`.
FeatureClass ClassOf(const GroundCamera& leaning, const Observation& first, const cv::Point2f& seen,
                     const Pose2& odometry_from_robot) {
  if (!first.point || seen.y <= leaning.HorizonRow(seen.x) + 1.0) return FeatureClass::kNotGround;
  constexpr double kRatio = 0.2;
  const Pose2 robot_from_odometry = odometry_from_robot.Inverse();
  const Eigen::Vector2d point = robot_from_odometry * *first.point;
  // Seen from the camera then, the ray to a raised point ended in the same place of the ground.
  const Eigen::Vector2d camera_then = robot_from_odometry * first.odometry_from_robot.translation();
  const Eigen::Vector2d raised = point + camera_then * kRatio / (1.0 - kRatio);
  const GroundProjection project(leaning);
  Eigen::Vector2d as_ground;
  Eigen::Vector2d as_raised;
  if (!project(point, as_ground) || !project(raised, as_raised)) return FeatureClass::kUndetermined;
  const Eigen::Vector2d lift = as_raised - as_ground;
  const Eigen::Vector2d error = Eigen::Vector2d(seen.x, seen.y) - as_ground;
  // Back-projection tolerance: two whole-pixel corners, and what the pose errs by.
  constexpr double kTolerance = 2.0;
  const double along = lift.norm() > 1e-6 ? error.dot(lift) / lift.norm() : 0.0;
  const double across = std::sqrt(std::max(error.squaredNorm() - along * along, 0.0));
  if (along > kTolerance || across > 1.5 * kTolerance) return FeatureClass::kNotGround;
  // Something a fifth of the camera's height up would have to show, or nothing is concluded.
  if (lift.norm() < 1.5 * kTolerance) return FeatureClass::kUndetermined;
  return FeatureClass::kGround;
}

MotionFilterOptions FilterOptionsOf(const GroundDetectorOptions& options) {
  MotionFilterOptions filter = options.filter;
  filter.leans = options.body_rocks;
  return filter;
}

}  // namespace

GroundOdometry::GroundOdometry(const GroundDetectorOptions& options)
    : options_(options), filter_(options.robot, FilterOptionsOf(options)) {}

void GroundOdometry::Restart() {
  memory_.clear();
  tracks_.clear();
  filter_.Restart();
  pose_.reset();
  labels_awaited_ = false;
}

FollowedFrame GroundOdometry::Follow(const std::vector<Feature>& features,
                                     const GreyPyramid& pyramid, Utime utime) {
  FollowedFrame result;
  result.motion_from = utime;
  result.located = true;
  result.pose_before = pose_;
  utime_ = utime;
  std::vector<TrackMatch> matches;
  if (!memory_.empty()) {
    const double dt_s = SecondsFromUtime(utime - memory_.back().utime);
    const Pose2 last = memory_.back().pose.frame_from_robot;
    result.motion_from = memory_.back().utime;
    const PoseEstimate estimate = Locate(features, pyramid, dt_s, matches);
    result.located = estimate.status == MotionStatus::kOk;
    result.pose = estimate.pose;
    result.motion.status = estimate.status;
    result.motion.inliers = estimate.inliers;
    if (result.located) {
      if (options_.Uses(DetectorPart::kHomographyCheck)) {
        result.check = Check(matches, features, estimate.pose);
      }
      result.motion.from_to = last.Inverse() * estimate.pose.frame_from_robot;
      // Covariance is that of a step in the newer robot frame; the motion is told in the older one.
      const double c = std::cos(result.motion.from_to.theta);
      const double s = std::sin(result.motion.from_to.theta);
      Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
      turn.topLeftCorner<2, 2>() << c, -s, s, c;
      result.motion.covariance =
          turn * estimate.covariance.topLeftCorner<3, 3>() * turn.transpose();
      filter_.Update(dt_s, estimate.pose, estimate.covariance, estimate.shows_lean);
    } else {
      matches.clear();
      // Without a pose for long, or from the start: what is remembered is out of reach, and this
      // frame begins anew.
      if (!filter_.knows_velocity() || dt_s > 0.5 * options_.memory_s) {
        if (result.pose_before) {
          result.pose_before->frame_from_robot =
              result.pose.frame_from_robot.Inverse() * result.pose_before->frame_from_robot;
        }
        Restart();
        result.located = true;
        result.pose = {};
      }
    }
  }
  pose_ = result.pose;
  AddToTracks(features, matches, result);
  // A frame that could not be located is passed over: the next one is matched with those before it.
  labels_awaited_ = result.located;
  if (!result.located) return result;
  memory_.push_back({utime, result.pose, pyramid, {}});
  Forget(utime);
  return result;
}

void GroundOdometry::LearnGround(const cv::Mat& labels) {
  if (!labels_awaited_) return;
  labels_awaited_ = false;
  RememberedFrame& frame = memory_.back();
  if (const RememberedFrame* key = NewestKeyframe(); key && options_.Uses(DetectorPart::kChain)) {
    const Pose2 way = key->pose.frame_from_robot.Inverse() * frame.pose.frame_from_robot;
    const bool is_near =
        way.translation().norm() < 0.25 * options_.camera.height_m && std::abs(way.theta) < 0.1;
    const bool is_recent = SecondsFromUtime(frame.utime - key->utime) < 0.5 * options_.memory_s;
    if (is_near && is_recent) return;
  }
  frame.texture =
      TakeGroundTexture(Rocked(options_.camera, frame.pose.pitch_rad, frame.pose.roll_rad),
                        frame.pyramid, labels, options_.alignment);
}

// Corners give the motion roughly whatever it is, brightness finely once it is known roughly.
PoseEstimate GroundOdometry::Locate(const std::vector<Feature>& features,
                                    const GreyPyramid& pyramid, double dt_s,
                                    std::vector<TrackMatch>& matches) const {
  MotionPrior prior = filter_.Predict(dt_s);
  matches = MatchWide(features, prior.pose, dt_s);
  // Where features show it, the body may lean as bodies do; else as little as it has lately.
  MotionPrior free = prior;
  if (options_.body_rocks) {
    free.information.bottomRightCorner<2, 2>() =
        Eigen::Matrix2d::Identity() / (kAnyLeanRad * kAnyLeanRad);
  }
  PoseEstimate estimate = LocateFrom(matches, features, free);
  const bool shows_lean =
      estimate.status == MotionStatus::kOk &&
      estimate.covariance.diagonal().tail<2>().maxCoeff() < kShownLeanRad * kShownLeanRad;
  if (shows_lean) {
    prior.information = free.information;
  } else {
    estimate = LocateFrom(matches, features, prior);
  }
  if (estimate.status == MotionStatus::kOk) {
    matches = MatchNarrow(features, estimate.pose);
    estimate = LocateFrom(matches, features, prior);
  }
  if (options_.Uses(DetectorPart::kAlignment)) {
    estimate = Align(estimate, prior, pyramid, dt_s);
    if (estimate.status == MotionStatus::kOk) matches = MatchNarrow(features, estimate.pose);
  }
  const Pose2 motion =
      memory_.back().pose.frame_from_robot.Inverse() * estimate.pose.frame_from_robot;
  if (estimate.status == MotionStatus::kOk && !IsPossible(motion, dt_s)) {
    estimate.status = MotionStatus::kInconsistent;
  }
  estimate.shows_lean = shows_lean;
  if (estimate.status != MotionStatus::kOk) estimate.pose = prior.pose;
  return estimate;
}

std::vector<TrackMatch> GroundOdometry::MatchWide(const std::vector<Feature>& features,
                                                  const BodyPose& predicted, double dt_s) const {
  const GroundCamera& camera = options_.camera;
  // Without a velocity anything that the robot can do may have happened; with one, what it can
  // change.
  const double turn_px = camera.fx * options_.robot.max_turn_radps * dt_s;
  const double radius = filter_.knows_velocity() ? 0.25 * turn_px : turn_px;
  const auto radius_px = static_cast<float>(std::clamp(radius, 12.0, 0.4 * camera.width));
  const Prediction predict(camera, predicted, utime_);
  return MatchTracks(
      tracks_, features,
      [&](const Track& track) {
        return SearchWindow{filter_.knows_velocity()
                                ? predict(track)
                                : std::vector<cv::Point2f>{track.seen.back().pixel},
                            radius_px};
      },
      kNarrowRadiusPx, options_.tracker);
}

std::vector<TrackMatch> GroundOdometry::MatchNarrow(const std::vector<Feature>& features,
                                                    const BodyPose& pose) const {
  const Prediction predict(options_.camera, pose, utime_);
  return MatchTracks(
      tracks_, features,
      [&](const Track& track) {
        const bool rises = track.feature_class == FeatureClass::kNotGround;
        return SearchWindow{predict(track), rises ? 2.5F * kNarrowRadiusPx : kNarrowRadiusPx};
      },
      kNarrowRadiusPx, options_.tracker);
}

PoseEstimate GroundOdometry::LocateFrom(const std::vector<TrackMatch>& matches,
                                        const std::vector<Feature>& features,
                                        const MotionPrior& prior) const {
  const GroundCamera leaning = Rocked(options_.camera, prior.pose.pitch_rad, prior.pose.roll_rad);
  std::vector<GroundMatch> ground;
  for (const TrackMatch& match : matches) {
    const Track& track = tracks_[static_cast<std::size_t>(match.track)];
    // The oldest sighting has the longest way to the present one; an error of a pixel then grows
    // with the square of how much nearer the point has come.
    const Observation& seen = track.seen.front();
    if (track.feature_class == FeatureClass::kNotGround || !seen.point) continue;
    const cv::Point2f now = features[static_cast<std::size_t>(match.feature)].pixel;
    const auto here = leaning.GroundFromPixel({now.x, now.y});
    if (!here) continue;
    const double then = (*seen.point - seen.odometry_from_robot.translation()).squaredNorm();
    const double growth = std::max(then / here->squaredNorm(), 1.0);
    ground.push_back({*seen.point, {now.x, now.y}, kPixelSigma * std::sqrt(1.0 + growth * growth)});
  }
  return EstimatePose(options_.camera, ground, prior, options_.motion);
}

// Twice the robot's limits leave room for their estimate and for a base that overshoots.
bool GroundOdometry::IsPossible(const Pose2& motion, double dt_s) const {
  return motion.translation().norm() < 2.0 * options_.robot.max_speed_mps * dt_s &&
         std::abs(motion.theta) < 2.0 * options_.robot.max_turn_radps * dt_s;
}

// The newest keyframe and the oldest that still shows much of the same ground. While the reference
// stays, its errors do not add up; and what moves by itself, as reflections do, misleads by less
// for the longer way.
std::vector<AlignmentReference> GroundOdometry::References() const {
  const Pose2& last = memory_.back().pose.frame_from_robot;
  std::vector<AlignmentReference> references;
  for (const RememberedFrame& frame : memory_) {
    if (frame.texture.empty()) continue;
    const Pose2 way = frame.pose.frame_from_robot.Inverse() * last;
    const bool overlaps =
        way.translation().norm() < options_.camera.height_m && std::abs(way.theta) < 0.2;
    const AlignmentReference reference{&frame.texture, frame.pose.frame_from_robot};
    if (overlaps && references.empty()) references.push_back(reference);
    if (&frame == NewestKeyframe()) {
      if (references.empty() || references.front().texture != &frame.texture) {
        references.push_back(reference);
      }
    }
  }
  return references;
}

const RememberedFrame* GroundOdometry::NewestKeyframe() const {
  for (auto frame = memory_.rbegin(); frame != memory_.rend(); ++frame) {
    if (!frame->texture.empty()) return &*frame;
  }
  return nullptr;
}

// Where there are no corners to speak of, brightness is asked alone, and has to be sure of its
// answer.
PoseEstimate GroundOdometry::Align(const PoseEstimate& from_features, const MotionPrior& prior,
                                   const GreyPyramid& pyramid, double dt_s) const {
  if (NewestKeyframe() == nullptr) return from_features;
  const bool have_features = from_features.status == MotionStatus::kOk;
  const std::vector<AlignmentReference> references = References();
  const BodyPose start = have_features ? from_features.pose : prior.pose;
  const bool searches = !have_features && !filter_.knows_velocity();
  std::vector<BodyPose> starts = {start};
  // Without any idea of the speed, faint reflections, which move as if the robot hardly did, may
  // catch the descent: the best of several starts counts.
  if (searches) {
    for (const double share : kSpeedsTried) {
      starts.push_back(start);
      Pose2& pose = starts.back().frame_from_robot;
      pose = pose * Pose2{share * options_.robot.max_speed_mps * dt_s, 0.0, 0.0};
    }
  }
  Alignment alignment;
  for (const BodyPose& from : starts) {
    const Alignment found = AlignGround(options_.camera, pyramid, references, from, prior, searches,
                                        options_.alignment);
    if (found.ok && (!alignment.ok || found.cost < alignment.cost)) alignment = found;
  }
  if (!alignment.ok) return from_features;
  const double height = options_.camera.height_m;
  const Vector5d change = StepBetween(start, alignment.pose);
  const double sigma_m = std::sqrt(alignment.covariance.topLeftCorner<2, 2>().trace());
  const double sigma_rad = std::sqrt(alignment.covariance(2, 2));
  const bool sure = sigma_m < 0.03 * height && sigma_rad < 0.005;
  const bool near_features = change.head<2>().norm() < 0.05 * height && std::abs(change(2)) < 0.02;
  const Pose2 motion =
      memory_.back().pose.frame_from_robot.Inverse() * alignment.pose.frame_from_robot;
  const bool possible = have_features ? near_features : IsPossible(motion, dt_s);
  if (!sure || !possible) return from_features;
  PoseEstimate estimate = from_features;
  estimate.status = MotionStatus::kOk;
  estimate.pose = alignment.pose;
  estimate.covariance = alignment.covariance;
  return estimate;
}

HomographyCheck GroundOdometry::Check(const std::vector<TrackMatch>& matches,
                                      const std::vector<Feature>& features,
                                      const BodyPose& pose) const {
  // All from one frame, the last.
  const RememberedFrame& last = memory_.back();
  std::vector<Eigen::Vector2d> before;
  std::vector<Eigen::Vector2d> now;
  for (const TrackMatch& match : matches) {
    const Track& track = tracks_[static_cast<std::size_t>(match.track)];
    const Observation& seen = track.seen.back();
    if (seen.utime != last.utime || track.feature_class == FeatureClass::kNotGround) continue;
    const cv::Point2f& pixel = features[static_cast<std::size_t>(match.feature)].pixel;
    before.emplace_back(seen.pixel.x, seen.pixel.y);
    now.emplace_back(pixel.x, pixel.y);
  }
  return CheckHomography(before, now, BeforeFromNow(options_.camera, pose, last.pose, 0.0),
                         kCheckTolerancePx);
}

void GroundOdometry::AddToTracks(const std::vector<Feature>& features,
                                 const std::vector<TrackMatch>& matches, FollowedFrame& result) {
  const Pose2& odometry_from_robot = result.pose.frame_from_robot;
  const GroundCamera leaning = Rocked(options_.camera, result.pose.pitch_rad, result.pose.roll_rad);
  const auto observe = [&](const cv::Point2f& pixel) {
    Observation seen{utime_, pixel, odometry_from_robot, {}};
    if (const auto point = leaning.GroundFromPixel({pixel.x, pixel.y})) {
      seen.point = odometry_from_robot * *point;
    }
    return seen;
  };
  result.features.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) result.features[i].pixel = features[i].pixel;
  for (const TrackMatch& match : matches) {
    Track& track = tracks_[static_cast<std::size_t>(match.track)];
    const auto i = static_cast<std::size_t>(match.feature);
    track.feature_class =
        ClassOf(leaning, track.seen.front(), features[i].pixel, odometry_from_robot);
    track.descriptor = features[i].descriptor;
    track.seen.push_back(observe(features[i].pixel));
    result.features[i].matched = true;
    result.features[i].feature_class = track.feature_class;
  }
  if (!result.located) return;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (result.features[i].matched) continue;
    tracks_.push_back(
        {features[i].descriptor, {observe(features[i].pixel)}, FeatureClass::kUndetermined});
  }
}

void GroundOdometry::Forget(Utime utime) {
  // A little more than the memory, so that a frame exactly that old counts whatever its jitter.
  const Utime oldest = utime - UtimeFromSeconds(1.05 * options_.memory_s);
  while (memory_.size() > 1 && memory_.front().utime < oldest) memory_.pop_front();
  const Utime kept =
      options_.Uses(DetectorPart::kChain) ? memory_.front().utime : memory_.back().utime;
  for (Track& track : tracks_) {
    while (!track.seen.empty() && track.seen.front().utime < kept) track.seen.pop_front();
  }
  std::erase_if(tracks_, [](const Track& track) { return track.seen.empty(); });
}

}  // namespace beckon
