#include "services/ground_detector/motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "services/ground_detector/projection.hpp"

namespace beckon {
namespace {

// Rigid motion that takes the two points `robot` to the two points `frame`.
Pose2 PoseFromTwoPoints(const Eigen::Vector2d& frame_a, const Eigen::Vector2d& frame_b,
                        const Eigen::Vector2d& robot_a, const Eigen::Vector2d& robot_b) {
  const Eigen::Vector2d frame = frame_b - frame_a;
  const Eigen::Vector2d robot = robot_b - robot_a;
  Pose2 pose{0.0, 0.0,
             WrapAngle(std::atan2(frame.y(), frame.x()) - std::atan2(robot.y(), robot.x()))};
  const Eigen::Vector2d centre = 0.5 * (frame_a + frame_b) - pose * (0.5 * (robot_a + robot_b));
  pose.x = centre.x();
  pose.y = centre.y();
  return pose;
}

// Error of a match over its sigma_px; infinite where it cannot be seen at all.
double NormalisedError(const GroundProjection& project, const GroundMatch& match,
                       const Pose2& robot_from_frame) {
  Eigen::Vector2d pixel;
  if (!project(robot_from_frame * match.point, pixel)) {
    return std::numeric_limits<double>::infinity();
  }
  return (pixel - match.pixel).norm() / match.sigma_px;
}

// Truncated quadratic, as in MSAC (Torr and Zisserman 2000): smaller is better.
double Cost(const GroundProjection& project, std::span<const GroundMatch> matches,
            const Pose2& pose, double tolerance) {
  const Pose2 robot_from_frame = pose.Inverse();
  double cost = 0.0;
  for (const GroundMatch& match : matches) {
    const double error = std::min(NormalisedError(project, match, robot_from_frame), tolerance);
    cost += error * error;
  }
  return cost;
}

// Normal equations of the pose, on (x, y, theta) of frame_from_robot, weighted with Tukey's
// function.
struct NormalEquations {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};

NormalEquations Linearise(const GroundProjection& project, std::span<const GroundMatch> matches,
                          const Pose2& pose, double tolerance) {
  NormalEquations equations;
  const double c = std::cos(pose.theta);
  const double s = std::sin(pose.theta);
  Eigen::Matrix2d robot_from_frame;
  robot_from_frame << c, s, -s, c;
  const Pose2 inverse = pose.Inverse();
  for (const GroundMatch& match : matches) {
    const Eigen::Vector2d point = inverse * match.point;
    Eigen::Vector2d pixel;
    Eigen::Matrix2d pixel_by_point;
    if (!project(point, pixel, pixel_by_point)) continue;
    const Eigen::Vector2d error = (pixel - match.pixel) / match.sigma_px;
    const double ratio = error.squaredNorm() / (tolerance * tolerance);
    if (ratio >= 1.0) continue;
    const double weight = (1.0 - ratio) * (1.0 - ratio);
    Eigen::Matrix<double, 2, 3> point_by_pose;
    point_by_pose.leftCols<2>() = -robot_from_frame;
    point_by_pose.col(2) = Eigen::Vector2d(point.y(), -point.x());
    const Eigen::Matrix<double, 2, 3> jacobian = pixel_by_point * point_by_pose / match.sigma_px;
    equations.information += weight * jacobian.transpose() * jacobian;
    equations.gradient += weight * jacobian.transpose() * error;
  }
  return equations;
}

}  // namespace

PoseEstimate EstimatePose(const GroundCamera& camera, std::span<const GroundMatch> matches,
                          const Pose2& predicted, const MotionOptions& options) {
  PoseEstimate estimate;
  estimate.inlier.assign(matches.size(), false);
  estimate.frame_from_robot = predicted;
  if (matches.size() < static_cast<std::size_t>(options.min_inliers)) return estimate;

  const GroundProjection project(camera);
  // Where each match would lie if it is ground, and which of them are near enough to make
  // hypotheses: a pixel far away says nothing about translation.
  std::vector<Eigen::Vector2d> seen(matches.size());
  std::vector<std::size_t> usable;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const auto point = camera.GroundFromPixel(matches[i].pixel);
    if (!point) continue;
    seen[i] = *point;
    if (point->norm() < 12.0 * camera.height_m) usable.push_back(i);
  }
  if (usable.size() < static_cast<std::size_t>(options.min_inliers)) return estimate;

  Pose2 best = predicted;
  double best_cost = Cost(project, matches, predicted, options.tolerance_px);
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> pick(0, usable.size() - 1);
  for (int i = 0; i < options.hypotheses; ++i) {
    const std::size_t a = usable[pick(random)];
    const std::size_t b = usable[pick(random)];
    const double distance = (seen[a] - seen[b]).norm();
    // Two points of the ground keep their distance; pairs that do not are no hypothesis.
    if (distance < 0.2 * camera.height_m ||
        std::abs((matches[a].point - matches[b].point).norm() - distance) > 0.1 * distance) {
      continue;
    }
    const Pose2 pose = PoseFromTwoPoints(matches[a].point, matches[b].point, seen[a], seen[b]);
    const double cost = Cost(project, matches, pose, options.tolerance_px);
    if (cost < best_cost) {
      best_cost = cost;
      best = pose;
    }
  }

  // The tolerance narrows from generous to fine, so that a rough hypothesis is drawn in first.
  NormalEquations equations;
  for (const double widening : {2.0, 1.5, 1.0, 1.0, 1.0}) {
    equations = Linearise(project, matches, best, widening * options.tolerance_px);
    equations.information.diagonal().array() += 1e-9;
    const Eigen::Vector3d step = -equations.information.ldlt().solve(equations.gradient);
    if (!step.allFinite()) break;
    best = {best.x + step.x(), best.y + step.y(), WrapAngle(best.theta + step.z())};
  }

  const Pose2 robot_from_frame = best.Inverse();
  double squared = 0.0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const double error = NormalisedError(project, matches[i], robot_from_frame);
    if (error < options.tolerance_px) {
      estimate.inlier[i] = true;
      ++estimate.inliers;
      squared += error * error;
    }
  }
  estimate.frame_from_robot = best;
  if (estimate.inliers < options.min_inliers) return estimate;
  // Spread of the residuals as found, so that a poor frame admits it.
  const double variance = std::max(squared / (2.0 * estimate.inliers - 3.0), 0.01);
  estimate.covariance = variance * equations.information.inverse();
  const bool agreed =
      estimate.inliers >= options.min_inlier_ratio * static_cast<double>(usable.size());
  estimate.status = agreed ? MotionStatus::kOk : MotionStatus::kInconsistent;
  return estimate;
}

Eigen::Matrix3d BeforeFromNow(const GroundCamera& camera, const Pose2& before_from_now,
                              double height_ratio) {
  const double scale = 1.0 / (1.0 - height_ratio);
  const double c = std::cos(before_from_now.theta);
  const double s = std::sin(before_from_now.theta);
  Eigen::Matrix3d motion;
  motion << c, -s, scale * before_from_now.x,  //
      s, c, scale * before_from_now.y,         //
      0.0, 0.0, 1.0;
  return camera.ground_from_image.inverse() * motion * camera.ground_from_image;
}

}  // namespace beckon
