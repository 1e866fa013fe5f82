#include "services/ground_detector/parallax.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "services/ground_detector/half_size.hpp"

namespace beckon {
namespace {

// Mean absolute difference in each cell when `before` is warped by the homography, infinite for
// cells that it does not show.
cv::Mat CellDifference(const cv::Mat& now, const cv::Mat& before,
                       const Eigen::Matrix3d& before_from_now, const cv::Size& cells) {
  const Eigen::Matrix3d half = FullFromHalf().inverse() * before_from_now * FullFromHalf();
  cv::Matx33d matrix;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix(row, column) = half(row, column);
  }
  cv::Mat warped;
  cv::warpPerspective(before, warped, matrix, now.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                      cv::BORDER_REPLICATE);
  cv::Mat difference;
  cv::absdiff(now, warped, difference);
  difference.convertTo(difference, CV_32F);
  cv::Mat mean;
  cv::resize(difference, mean, cells, 0.0, 0.0, cv::INTER_AREA);

  const double cell_width = static_cast<double>(now.cols) / cells.width;
  const double cell_height = static_cast<double>(now.rows) / cells.height;
  for (int row = 0; row < cells.height; ++row) {
    for (int column = 0; column < cells.width; ++column) {
      const Eigen::Vector3d centre((column + 0.5) * cell_width, (row + 0.5) * cell_height, 1.0);
      const Eigen::Vector3d seen = half * centre;
      const double u = seen.x() / seen.z();
      const double v = seen.y() / seen.z();
      const bool inside = u > 0.5 * cell_width && u < now.cols - 0.5 * cell_width &&
                          v > 0.5 * cell_height && v < now.rows - 0.5 * cell_height;
      if (!inside) mean.at<float>(row, column) = std::numeric_limits<float>::infinity();
    }
  }
  return mean;
}

// How much grey levels vary within a cell.
cv::Mat CellTexture(const cv::Mat& now, const cv::Size& cells) {
  cv::Mat smooth;
  cv::blur(now, smooth, {9, 9});
  cv::Mat detail;
  cv::absdiff(now, smooth, detail);
  detail.convertTo(detail, CV_32F);
  cv::resize(detail, detail, cells, 0.0, 0.0, cv::INTER_AREA);
  return detail;
}

}  // namespace

cv::Mat GroundEvidence(const GroundCamera& camera, const cv::Mat& now, const cv::Mat& before,
                       const BodyPose& now_pose, const BodyPose& before_pose, const cv::Size& cells,
                       const ParallaxOptions& options) {
  const auto difference_at = [&](double ratio) {
    return CellDifference(now, before, BeforeFromNow(camera, before_pose, now_pose, ratio), cells);
  };
  const cv::Mat ground = difference_at(0.0);
  cv::Mat below(cells, CV_32FC1, cv::Scalar(std::numeric_limits<float>::infinity()));
  for (const double ratio : options.reflection_ratios) {
    cv::min(below, difference_at(ratio), below);
  }
  cv::Mat alternative(cells, CV_32FC1, cv::Scalar(std::numeric_limits<float>::infinity()));
  for (const double ratio : options.height_ratios) {
    cv::min(alternative, difference_at(ratio), alternative);
  }
  const GroundCamera leaning = Rocked(camera, now_pose.pitch_rad, now_pose.roll_rad);
  const cv::Mat texture = CellTexture(now, cells);
  cv::Mat evidence(cells, CV_32FC1, cv::Scalar(0.0));
  for (int row = 0; row < cells.height; ++row) {
    for (int column = 0; column < cells.width; ++column) {
      // The top of the cell: all of it has to lie below the horizon.
      const double v = static_cast<double>(row) * camera.height / cells.height;
      const double u = (column + 0.5) * camera.width / cells.width;
      if (v <= leaning.HorizonRow(u) + 1.0) continue;
      const float as_ground = ground.at<float>(row, column);
      const float otherwise = alternative.at<float>(row, column);
      if (!std::isfinite(as_ground) || !std::isfinite(otherwise)) continue;
      // The best of several alternatives wins by noise alone a little more often than not: the
      // noise in the denominator keeps that near 0.
      const auto balance_of = [&](float worse, float better) {
        return (worse - better) / (worse + better + 2.0F * options.noise_grey);
      };
      // What moves like a plane below the ground does not stand up. But it may be the floor at the
      // bottom of a step and no reflection: the clearer it lies below, the less it is ground.
      const float as_below = below.at<float>(row, column);
      float balance = balance_of(otherwise, std::min(as_ground, as_below));
      if (balance > 0.0F) {
        constexpr float kClearlyBelow = 0.3F;
        const float lies_below = std::max(0.0F, balance_of(as_ground, as_below));
        balance = std::max(0.0F, balance_of(otherwise, as_ground)) *
                  std::max(0.0F, 1.0F - lies_below / kClearlyBelow);
      }
      // Where neither fits, for the texture that there is, something was hidden before or moves by
      // itself, and which of the two misfits less means little.
      const float misfit =
          std::min(otherwise, as_ground) / (texture.at<float>(row, column) + options.noise_grey);
      evidence.at<float>(row, column) = balance / (1.0F + misfit * misfit);
    }
  }
  return evidence;
}

}  // namespace beckon
