#include "services/ground_detector/ground_detector.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "common/robot_file.hpp"

namespace beckon {
namespace {

constexpr float kNarrowRadiusPx = 3.0F;  // around where motion says that a feature is
constexpr double kPixelSigma = 0.5;      // of a FAST corner, which has whole pixels
constexpr float kUnsure = 0.7F;          // log-odds; a probability from 1/3 to 2/3
constexpr float kClear = 1.0F;           // log-odds that some cell of a region has to reach
constexpr double kDarkGrey = 8.0;        // mean grey level below which nothing can be seen

class Stopwatch {
 public:
  // Milliseconds since the start or the last lap.
  double Lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Nothing for points that the homography puts behind the camera.
std::optional<Eigen::Vector2d> Apply(const Eigen::Matrix3d& homography, const cv::Point2f& pixel) {
  const Eigen::Vector3d moved = homography * Eigen::Vector3d(pixel.x, pixel.y, 1.0);
  if (moved.z() <= 1e-9) return std::nullopt;
  return Eigen::Vector2d(moved.head<2>() / moved.z());
}

// Which cells are ground (255) and which are undetermined (255 in `unsure`): those without clear
// log-odds over some area, and those whose log-odds are nowhere near them clear. Between ground and
// not, the log-odds pass through 0 as well, but there the border decides.
cv::Mat DecideCells(const cv::Mat& log_odds, cv::Mat& unsure) {
  unsure = cv::abs(log_odds) <= kUnsure;
  cv::morphologyEx(unsure, unsure, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8UC1));
  cv::Mat ground = log_odds > 0.0F;
  ground.setTo(0, unsure);
  for (const float sign : {1.0F, -1.0F}) {
    const cv::Mat side = sign > 0.0F ? ground.clone() : cv::Mat(~ground & ~unsure);
    cv::Mat components;
    const int count = cv::connectedComponents(side, components, 4);
    std::vector<bool> clear(static_cast<std::size_t>(count), false);
    for (int v = 0; v < side.rows; ++v) {
      for (int u = 0; u < side.cols; ++u) {
        if (sign * log_odds.at<float>(v, u) > kClear) {
          clear[static_cast<std::size_t>(components.at<int>(v, u))] = true;
        }
      }
    }
    for (int v = 0; v < side.rows; ++v) {
      for (int u = 0; u < side.cols; ++u) {
        const int component = components.at<int>(v, u);
        if (component == 0 || clear[static_cast<std::size_t>(component)]) continue;
        unsure.at<std::uint8_t>(v, u) = 255;
        ground.at<std::uint8_t>(v, u) = 0;
      }
    }
  }
  return ground;
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

const std::vector<std::string>& DetectorParts() {
  static const std::vector<std::string> parts = {"alignment", "parallax", "colour", "history",
                                                 "borders"};
  return parts;
}

void LeaveOut(const std::string& part, GroundDetectorOptions& options) {
  if (part == "alignment") {
    options.use_alignment = false;
  } else if (part == "parallax") {
    options.use_parallax = false;
  } else if (part == "colour") {
    options.classifier.colour_weight = 0.0F;
  } else if (part == "history") {
    options.classifier.keep = 0.0F;
  } else if (part == "borders") {
    options.use_borders = false;
  } else {
    throw std::invalid_argument("there is no part \"" + part + "\" to leave out");
  }
}

GroundDetectorOptions ReadGroundDetectorOptions(ConfigFile& file) {
  GroundDetectorOptions options;
  std::filesystem::path calibration;
  file.Table("camera").RequiredPath("calibration", calibration);
  options.camera = GroundCamera::Load(calibration);
  const RobotOptions robot = ReadRobotOptions(file);
  options.max_speed_mps = robot.max_speed_mps;
  options.max_turn_radps = robot.max_turn_radps;
  ConfigTable& table = file.Table("ground_detector");
  table.Optional("memory_s", options.memory_s, {0.1, 5.0});
  table.Optional("max_gap_s", options.max_gap_s, {0.1, 10.0});
  table.Optional("fast_threshold", options.features.fast_threshold, {2, 100});
  return options;
}

GroundDetector::GroundDetector(const GroundDetectorOptions& options)
    : options_(options), classifier_(options.classifier) {
  const GroundCamera& camera = options_.camera;
  cells_ = {std::max(camera.width / options_.scale, 1),
            std::max(camera.height / options_.scale, 1)};
  above_horizon_.create(cells_, CV_8UC1);
  near_.create(cells_, CV_8UC1);
  const auto bottom = camera.GroundFromPixel({camera.cx, camera.height - 1.0});
  if (!bottom) throw std::invalid_argument("the camera does not see the ground");
  for (int row = 0; row < cells_.height; ++row) {
    for (int column = 0; column < cells_.width; ++column) {
      const double u = (column + 0.5) * camera.width / cells_.width - 0.5;
      const double top = static_cast<double>(row) * camera.height / cells_.height - 0.5;
      const double v = (row + 0.5) * camera.height / cells_.height - 0.5;
      above_horizon_.at<std::uint8_t>(row, column) = top <= camera.HorizonRow(u) ? 255 : 0;
      const auto point = camera.GroundFromPixel({u, v});
      const bool near =
          point && point->x() < 1.4 * bottom->x() && std::abs(point->y()) < 0.5 * camera.height_m;
      near_.at<std::uint8_t>(row, column) = near ? 255 : 0;
    }
  }
  not_below_horizon_.create(camera.height, camera.width, CV_8UC1);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      not_below_horizon_.at<std::uint8_t>(v, u) = v <= camera.HorizonRow(u) ? 255 : 0;
    }
  }
  if (camera.has_distortion()) {
    taken_from_ideal_.create(camera.height, camera.width, CV_32FC2);
    ideal_from_taken_.create(camera.height, camera.width, CV_32FC2);
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const Eigen::Vector2f taken = camera.Distorted({u, v}).cast<float>();
        const Eigen::Vector2f ideal = camera.Undistorted({u, v}).cast<float>();
        taken_from_ideal_.at<cv::Vec2f>(v, u) = {taken.x(), taken.y()};
        ideal_from_taken_.at<cv::Vec2f>(v, u) = {ideal.x(), ideal.y()};
      }
    }
  }
}

cv::Mat GroundDetector::IdealFromTaken(const cv::Mat& bgr) const {
  if (taken_from_ideal_.empty()) return bgr;
  cv::Mat ideal;
  cv::remap(bgr, ideal, taken_from_ideal_, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return ideal;
}

cv::Mat GroundDetector::TakenFromIdeal(const cv::Mat& labels) const {
  if (ideal_from_taken_.empty()) return labels;
  cv::Mat taken;
  cv::remap(labels, taken, ideal_from_taken_, {}, cv::INTER_NEAREST, cv::BORDER_CONSTANT,
            cv::Scalar(kUndetermined));
  return taken;
}

void GroundDetector::Restart() {
  memory_.clear();
  tracks_.clear();
  velocity_ = {};
  velocity_known_ = false;
  before_from_now_.reset();
}

void GroundDetector::Forget(Utime utime) {
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

const GroundDetector::Memory* GroundDetector::Remembered(std::int64_t number) const {
  const std::int64_t index = number - memory_.front().number;
  return &memory_[static_cast<std::size_t>(index)];
}

std::vector<cv::Point2f> GroundDetector::Predict(const Track& track, const Pose2& pose) const {
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

std::vector<TrackMatch> GroundDetector::MatchWide(const std::vector<Feature>& features,
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

std::vector<TrackMatch> GroundDetector::MatchNarrow(const std::vector<Feature>& features,
                                                    const Pose2& pose) const {
  return MatchTracks(
      tracks_, features,
      [&](const Track& track) {
        const bool rises = track.feature_class == FeatureClass::kNotGround;
        return SearchWindow{Predict(track, pose), rises ? 2.5F * kNarrowRadiusPx : kNarrowRadiusPx};
      },
      kNarrowRadiusPx, options_.tracker);
}

PoseEstimate GroundDetector::LocateFrom(const std::vector<TrackMatch>& matches,
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
FeatureClass GroundDetector::Classify(const Track& track, const cv::Point2f& pixel,
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
bool GroundDetector::IsPossible(const Pose2& motion, double dt_s) const {
  return motion.translation().norm() < 2.0 * options_.max_speed_mps * dt_s &&
         std::abs(motion.theta) < 2.0 * options_.max_turn_radps * dt_s;
}

// Corners give the motion roughly whatever it is, brightness finely once it is known roughly. Where
// there are no corners to speak of, brightness is asked alone, and has to be sure of its answer.
PoseEstimate GroundDetector::Align(const PoseEstimate& from_features, const GreyPyramid& pyramid,
                                   double dt_s) const {
  const Memory& last = memory_.back();
  const bool have_features = from_features.status == MotionStatus::kOk;
  const Pose2 predicted = have_features
                              ? last.odometry_from_robot.Inverse() * from_features.frame_from_robot
                              : Scaled(velocity_, dt_s);
  const Alignment alignment =
      AlignGround(options_.camera, pyramid, last.pyramid, expected_ground_, predicted,
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

void GroundDetector::FollowFeatures(const std::vector<Feature>& features,
                                    const GreyPyramid& pyramid, Utime utime, GroundFrame& result) {
  Pose2 pose;
  std::vector<TrackMatch> matches;
  before_from_now_.reset();
  located_ = true;
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
    if (options_.use_alignment) {
      estimate = Align(estimate, pyramid, dt_s);
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
    located_ = estimate.status == MotionStatus::kOk;
    pose = located_ ? estimate.frame_from_robot : predicted;
    before_from_now_ = pose_.Inverse() * pose;
    if (located_) {
      result.motion.from_to = motion;
      // Covariance is found in the odometry frame; the motion is told in the older robot frame.
      const Eigen::Matrix3d turn = Turn(-last.theta);
      result.motion.covariance = turn * estimate.covariance * turn.transpose();
      velocity_ = Scaled(motion, 1.0 / dt_s);
      velocity_known_ = true;
    } else if (!velocity_known_ || dt_s > 0.5 * options_.memory_s) {
      // Without a pose for long, or from the start: what is remembered is out of reach, and this
      // frame begins anew.
      memory_.clear();
      tracks_.clear();
      velocity_ = {};
      velocity_known_ = false;
      located_ = true;
    }
    if (result.motion.status != MotionStatus::kOk) matches.clear();
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
  if (!located_) return;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (result.features[i].matched) continue;
    tracks_.push_back(
        {features[i].descriptor, {{number_, features[i].pixel}}, FeatureClass::kUndetermined});
  }
  memory_.push_back({number_, utime, pose, pyramid});
  Forget(utime);
}

// Evidence of two earlier frames: one near in place, for what is close by and has left older
// pictures, and the one farthest away, for the distance.
cv::Mat GroundDetector::Evidence() const {
  const Pose2& now = pose_;
  const double height = options_.camera.height_m;
  const Memory* near = nullptr;
  const Memory* far = nullptr;
  double far_distance = 0.5 * height;
  for (const Memory& memory : memory_) {
    const double distance = (memory.odometry_from_robot.translation() - now.translation()).norm();
    if (distance > 0.15 * height) near = &memory;  // the newest that is far enough
    if (distance > far_distance) {
      far_distance = distance;
      far = &memory;
    }
  }
  cv::Mat evidence;
  for (const Memory* memory : {near, far}) {
    if (memory == nullptr || (memory == far && far == near)) continue;
    const cv::Mat one =
        GroundEvidence(options_.camera, memory_.back().pyramid[0], memory->pyramid[0],
                       memory->odometry_from_robot.Inverse() * now, cells_, options_.parallax);
    evidence = evidence.empty() ? one : cv::Mat(evidence + one);
  }
  return evidence;
}

GroundFrame GroundDetector::Process(const cv::Mat& bgr, Utime utime) {
  const GroundCamera& camera = options_.camera;
  if (bgr.type() != CV_8UC3 || bgr.cols != camera.width || bgr.rows != camera.height) {
    throw std::invalid_argument("frame refused: not a colour picture of " +
                                std::to_string(camera.width) + " x " +
                                std::to_string(camera.height) + " pixels");
  }
  Stopwatch total;
  GroundFrame result;
  result.utime = utime;
  result.motion_from = utime;
  if (!memory_.empty()) {
    const double gap_s = SecondsFromUtime(utime - memory_.back().utime);
    if (gap_s <= 0.0 || gap_s > options_.max_gap_s) {
      Restart();
      classifier_.Restart();
    }
  }
  ++number_;

  const cv::Mat ideal = IdealFromTaken(bgr);
  cv::Mat grey;
  cv::cvtColor(ideal, grey, cv::COLOR_BGR2GRAY);
  if (cv::mean(grey)[0] < kDarkGrey) {
    Restart();
    classifier_.Restart();
    result.motion.status = MotionStatus::kTooFewFeatures;
    result.labels = cv::Mat(bgr.size(), CV_8UC1, cv::Scalar(kUndetermined));
    result.ms.total = total.Lap();
    return result;
  }

  // Branch b: segments. Branch a: features and motion.
  cv::Mat small;
  auto segmenting = std::async(std::launch::async, [&] {
    Stopwatch watch;
    cv::resize(ideal, small, cells_, 0.0, 0.0, cv::INTER_AREA);
    Segmentation segments = MeanShiftSegments(
        HsiFromBgr(small, options_.mean_shift.colourless_saturation), options_.mean_shift);
    result.ms.segmentation = watch.Lap();
    return segments;
  });
  Stopwatch watch;
  const GreyPyramid pyramid = MakePyramid(grey);
  const std::vector<Feature> features = DetectFeatures(grey, options_.features);
  result.ms.features = watch.Lap();
  FollowFeatures(features, pyramid, utime, result);
  result.ms.motion = watch.Lap();
  const cv::Mat evidence = options_.use_parallax && located_ ? Evidence() : cv::Mat();
  result.ms.parallax = watch.Lap();
  const Segmentation segments = segmenting.get();
  watch.Lap();

  std::optional<Eigen::Matrix3d> cells_before_from_now;
  if (before_from_now_) {
    Eigen::Matrix3d pixel_from_cell;
    const double width = static_cast<double>(camera.width) / cells_.width;
    const double height = static_cast<double>(camera.height) / cells_.height;
    pixel_from_cell << width, 0.0, 0.5 * width - 0.5, 0.0, height, 0.5 * height - 0.5, 0.0, 0.0,
        1.0;
    cells_before_from_now =
        pixel_from_cell.inverse() * BeforeFromNow(camera, *before_from_now_, 0.0) * pixel_from_cell;
  }
  const cv::Mat log_odds =
      classifier_.Update({segments, small, evidence, above_horizon_, near_, cells_before_from_now});
  expected_ground_ = log_odds > kUnsure;
  result.ms.classification = watch.Lap();

  cv::Mat unsure;
  cv::Mat ground = DecideCells(log_odds, unsure);
  if (options_.use_borders) {
    ground = RefineBorders(ideal, ground, options_.borders);
  } else {
    cv::resize(ground, ground, ideal.size(), 0.0, 0.0, cv::INTER_NEAREST);
  }
  cv::resize(unsure, unsure, ideal.size(), 0.0, 0.0, cv::INTER_NEAREST);
  cv::Mat labels(ideal.size(), CV_8UC1, cv::Scalar(kNotGround));
  labels.setTo(kUndetermined, unsure);
  labels.setTo(kGround, ground);
  labels.setTo(kNotGround, not_below_horizon_);
  result.labels = TakenFromIdeal(labels);
  result.segments = segments;
  result.evidence = evidence;
  result.log_odds = log_odds;
  for (ClassifiedFeature& feature : result.features) {
    // Back-projection and the region around it have to agree: alone, a feature that was mistaken
    // for its neighbour contradicts the ground that it lies on.
    const auto label = labels.at<std::uint8_t>(cvRound(feature.pixel.y), cvRound(feature.pixel.x));
    if (label != static_cast<std::uint8_t>(feature.feature_class)) {
      feature.feature_class = FeatureClass::kUndetermined;
    }
    if (!camera.has_distortion()) continue;
    const Eigen::Vector2f taken =
        camera.Distorted({feature.pixel.x, feature.pixel.y}).cast<float>();
    feature.pixel = {taken.x(), taken.y()};
  }
  result.ms.borders = watch.Lap();
  result.ms.total = total.Lap();
  return result;
}

}  // namespace beckon
