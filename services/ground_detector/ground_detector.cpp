#include "services/ground_detector/ground_detector.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <future>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "services/ground_detector/labels.hpp"

namespace beckon {
namespace {

constexpr double kDarkGrey = 8.0;  // mean grey level below which nothing can be seen

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

ClassifierOptions ClassifierOptionsOf(const GroundDetectorOptions& options) {
  ClassifierOptions classifier = options.classifier;
  if (!options.Uses(DetectorPart::kColour)) classifier.colour_weight = 0.0F;
  if (!options.Uses(DetectorPart::kHistory)) classifier.keep = 0.0F;
  return classifier;
}

}  // namespace

GroundDetector::GroundDetector(const GroundDetectorOptions& options)
    : options_(options),
      view_(options.camera, options.scale),
      odometry_(options),
      classifier_(ClassifierOptionsOf(options)) {}

void GroundDetector::Restart() {
  odometry_.Restart();
  classifier_.Restart();
}

// Two earlier frames to see parallax from: one near in place, for what is close by and has left
// older pictures, and the one farthest away, for the distance. Just after the start that may be a
// very near one: where there is texture, even that tells most of the floor from what stands on it.
std::vector<const RememberedFrame*> GroundDetector::EarlierFrames() const {
  const RememberedFrame& now = odometry_.memory().back();
  const double height = options_.camera.height_m;
  const double least = 0.05 * height;
  const double enough = 0.15 * height;
  const RememberedFrame* near = nullptr;
  const RememberedFrame* far = nullptr;
  double near_distance = least;
  double far_distance = 0.5 * height;
  for (const RememberedFrame& before : odometry_.memory()) {
    const double distance =
        (before.pose.frame_from_robot.translation() - now.pose.frame_from_robot.translation())
            .norm();
    // The newest that is far enough; until there is one, the farthest.
    if (distance > std::min(near_distance, enough)) {
      near = &before;
      near_distance = distance;
    }
    if (distance > far_distance) {
      far_distance = distance;
      far = &before;
    }
  }
  std::vector<const RememberedFrame*> frames;
  if (near != nullptr) frames.push_back(near);
  if (far != nullptr && far != near) frames.push_back(far);
  return frames;
}

cv::Mat GroundDetector::Evidence() const {
  const RememberedFrame& now = odometry_.memory().back();
  cv::Mat evidence;
  for (const RememberedFrame* before : EarlierFrames()) {
    const cv::Mat one = GroundEvidence(options_.camera, now.pyramid[0], before->pyramid[0],
                                       now.pose, before->pose, view_.cells(), options_.parallax);
    evidence = evidence.empty() ? one : cv::Mat(evidence + one);
  }
  return evidence;
}

cv::Mat GroundDetector::Feet(const cv::Mat& ground, const cv::Mat& where) const {
  const RememberedFrame& now = odometry_.memory().back();
  std::vector<PosedGrey> before;
  for (const RememberedFrame* frame : EarlierFrames()) {
    before.push_back({&frame->pyramid[0], frame->pose});
  }
  if (before.empty()) return {};
  return FootLogOdds(options_.camera, {&now.pyramid[0], now.pose}, before, ground, where,
                     options_.foot_line);
}

// Back-projection and the region around it have to agree: alone, a feature that was mistaken for
// its neighbour contradicts the ground that it lies on. A corner just at a border is of both sides.
void GroundDetector::SettleFeatures(const cv::Mat& labels,
                                    std::vector<ClassifiedFeature>& features) const {
  for (ClassifiedFeature& feature : features) {
    constexpr int kBorderPx = 2;  // what a corner and a border err by
    const cv::Rect around =
        cv::Rect(cvRound(feature.pixel.x) - kBorderPx, cvRound(feature.pixel.y) - kBorderPx,
                 2 * kBorderPx + 1, 2 * kBorderPx + 1) &
        cv::Rect({}, labels.size());
    const auto own = static_cast<double>(feature.feature_class);
    if (cv::countNonZero(labels(around) != own) > 0) {
      feature.feature_class = FeatureClass::kUndetermined;
    }
    if (!options_.camera.has_distortion()) continue;
    const Eigen::Vector2f taken =
        options_.camera.Distorted({feature.pixel.x, feature.pixel.y}).cast<float>();
    feature.pixel = {taken.x(), taken.y()};
  }
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

  // What is not just before this frame in time is not compared with it.
  if (!odometry_.memory().empty()) {
    const double gap_s = SecondsFromUtime(utime - odometry_.memory().back().utime);
    if (gap_s <= 0.0 || gap_s > options_.max_gap_s) Restart();
  }

  // Take out the lens; in the dark, say nothing.
  const cv::Mat ideal = view_.IdealFromTaken(bgr);
  cv::Mat grey;
  cv::cvtColor(ideal, grey, cv::COLOR_BGR2GRAY);
  if (cv::mean(grey)[0] < kDarkGrey) {
    Restart();
    result.motion.status = MotionStatus::kTooFewFeatures;
    result.labels = cv::Mat(bgr.size(), CV_8UC1, cv::Scalar(kUndetermined));
    result.ms.total = total.Lap();
    return result;
  }

  // Branch b, at the same time as a: segments of the small picture.
  cv::Mat small;
  auto segmenting = std::async(std::launch::async, [&] {
    Stopwatch watch;
    cv::resize(ideal, small, view_.cells(), 0.0, 0.0, cv::INTER_AREA);
    Segmentation segments = MeanShiftSegments(
        HsiFromBgr(small, options_.mean_shift.colourless_saturation), options_.mean_shift);
    result.ms.segmentation = watch.Lap();
    return segments;
  });

  // Branch a: features,
  Stopwatch watch;
  const GreyPyramid pyramid = MakePyramid(grey);
  const std::vector<Feature> features = DetectFeatures(grey, options_.features);
  result.ms.features = watch.Lap();
  // the motion of the ground, and with it the class of each feature,
  FollowedFrame followed = odometry_.Follow(features, pyramid, utime);
  result.motion = followed.motion;
  result.motion_from = followed.motion_from;
  result.check = followed.check;
  result.pitch_rad = followed.pose.pitch_rad;
  result.roll_rad = followed.pose.roll_rad;
  result.ms.motion = watch.Lap();
  // and what the motion says of each part of the picture.
  if (followed.located && options_.Uses(DetectorPart::kParallax)) result.evidence = Evidence();
  result.ms.parallax = watch.Lap();

  // Both together: log-odds of ground for each cell, from motion, colour and memory.
  result.segments = segmenting.get();
  watch.Lap();
  std::optional<Eigen::Matrix3d> cells_before_from_now;
  if (followed.pose_before) {
    cells_before_from_now = view_.cell_from_pixel() *
                            BeforeFromNow(camera, *followed.pose_before, followed.pose, 0.0) *
                            view_.cell_from_pixel().inverse();
  }
  result.log_odds =
      classifier_.Update({result.segments, small, result.evidence, view_.above_horizon(),
                          view_.just_above_horizon(), view_.near(), cells_before_from_now});
  result.ms.classification = watch.Lap();

  // Borders to the pixel, in the frame as taken.
  FeetFinder find_feet;
  if (followed.located && options_.Uses(DetectorPart::kParallax)) {
    find_feet = [this](const cv::Mat& ground, const cv::Mat& where) { return Feet(ground, where); };
  }
  cv::Mat labels = LabelPixels(ideal, result.log_odds, find_feet,
                               options_.Uses(DetectorPart::kBorders), options_.borders);
  labels.setTo(kNotGround, view_.not_below_horizon());
  odometry_.LearnGround(labels);
  result.labels = view_.TakenFromIdeal(labels);
  result.features = std::move(followed.features);
  SettleFeatures(labels, result.features);
  result.ms.borders = watch.Lap();
  result.ms.total = total.Lap();
  return result;
}

}  // namespace beckon
