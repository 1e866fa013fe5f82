#include "services/ground_detector/messages.hpp"

#include <opencv2/core.hpp>

namespace beckon {
namespace {

// Each square takes the label that is safest for all of it: ground only where all of it is, and
// not ground where any is.
cv::Mat Coarsened(const cv::Mat& labels, int side) {
  cv::Mat coarse = labels.clone();
  for (int v = 0; v < labels.rows; v += side) {
    for (int u = 0; u < labels.cols; u += side) {
      const cv::Rect square = cv::Rect(u, v, side, side) & cv::Rect({}, labels.size());
      cv::Mat block = coarse(square);
      if (cv::countNonZero(block == kNotGround) > 0) {
        block.setTo(kNotGround);
      } else if (cv::countNonZero(block != kGround) > 0) {
        block.setTo(kUndetermined);
      }
    }
  }
  return coarse;
}

}  // namespace

ground_t MakeGroundMessage(const GroundFrame& frame) {
  ground_t message{};
  message.utime = frame.utime;
  message.width = frame.labels.cols;
  message.height = frame.labels.rows;
  message.runs = EncodeLabels(frame.labels);
  // Each round takes a coarser grid; at one square for the picture it fits for sure.
  for (int side = 2; message.runs.size() > kMaxRunBytes; side *= 2) {
    message.runs = EncodeLabels(Coarsened(frame.labels, side));
  }
  message.size = static_cast<std::int32_t>(message.runs.size());
  message.pitch_rad = static_cast<float>(frame.pitch_rad);
  message.roll_rad = static_cast<float>(frame.roll_rad);
  for (const ClassifiedFeature& feature : frame.features) {
    message.features += feature.matched ? 1 : 0;
    message.ground_features +=
        feature.matched && feature.feature_class == FeatureClass::kGround ? 1 : 0;
  }
  message.processing_ms = static_cast<float>(frame.ms.total);
  return message;
}

planar_motion_t MakeMotionMessage(const GroundFrame& frame) {
  static_assert(static_cast<int>(MotionStatus::kOk) == planar_motion_t::OK &&
                static_cast<int>(MotionStatus::kTooFewFeatures) ==
                    planar_motion_t::TOO_FEW_FEATURES &&
                static_cast<int>(MotionStatus::kInconsistent) == planar_motion_t::INCONSISTENT &&
                static_cast<int>(MotionStatus::kRestart) == planar_motion_t::RESTART);
  planar_motion_t message{};
  message.utime = frame.utime;
  message.utime_from = frame.motion_from;
  message.status = static_cast<std::int8_t>(frame.motion.status);
  message.translation[0] = frame.motion.from_to.x;
  message.translation[1] = frame.motion.from_to.y;
  message.rotation_rad = frame.motion.from_to.theta;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      message.covariance[3 * row + column] = frame.motion.covariance(row, column);
    }
  }
  message.inliers = frame.motion.inliers;
  return message;
}

}  // namespace beckon
