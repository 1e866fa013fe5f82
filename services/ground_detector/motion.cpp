#include "services/ground_detector/motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <random>

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

// Over the tolerance once the lean is known.
constexpr double kLeanAllowance = 3.0;

// Error of a match over its sigma_px; infinite where it cannot be seen at all.
double NormalisedError(const GroundProjection& project, const GroundMatch& match,
                       const Pose2& robot_from_frame) {
  Eigen::Vector2d pixel;
  if (!project(robot_from_frame * match.point, pixel)) {
    return std::numeric_limits<double>::infinity();
  }
  return (pixel - match.pixel).norm() / match.sigma_px;
}

// Truncated quadratic, as in MSAC: smaller is better.
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

struct NormalEquations {
  Matrix5d information = Matrix5d::Zero();
  Vector5d gradient = Vector5d::Zero();
};

// Weighted with Tukey's function.
NormalEquations Linearise(const GroundCamera& camera, std::span<const GroundMatch> matches,
                          const BodyPose& pose, double tolerance) {
  const GroundProjection project(Rocked(camera, pose.pitch_rad, pose.roll_rad));
  NormalEquations equations;
  const Pose2 robot_from_frame = pose.frame_from_robot.Inverse();
  for (const GroundMatch& match : matches) {
    const Eigen::Vector2d point = robot_from_frame * match.point;
    Eigen::Vector2d pixel;
    Eigen::Matrix2d pixel_by_point;
    if (!project(point, pixel, pixel_by_point)) continue;
    const Eigen::Vector2d error = (pixel - match.pixel) / match.sigma_px;
    const double ratio = error.squaredNorm() / (tolerance * tolerance);
    if (ratio >= 1.0) continue;
    const double weight = (1.0 - ratio) * (1.0 - ratio);
    const Eigen::Matrix<double, 2, 5> jacobian =
        pixel_by_point * ApparentMotion(point, camera.height_m) / match.sigma_px;
    equations.information += weight * jacobian.transpose() * jacobian;
    equations.gradient += weight * jacobian.transpose() * error;
  }
  return equations;
}

}  // namespace

BodyPose Moved(const BodyPose& pose, const Vector5d& step) {
  return {pose.frame_from_robot * Pose2{step(0), step(1), step(2)}, pose.pitch_rad + step(3),
          pose.roll_rad + step(4)};
}

Vector5d StepBetween(const BodyPose& from, const BodyPose& to) {
  const Pose2 motion = from.frame_from_robot.Inverse() * to.frame_from_robot;
  Vector5d step;
  step << motion.x, motion.y, motion.theta, to.pitch_rad - from.pitch_rad,
      to.roll_rad - from.roll_rad;
  return step;
}

// A body that turns by (roll, pitch) about x and y takes the ray (x, y, -height) along; that ray
// meets the ground elsewhere. What is fixed to the ground seems to move the other way.
Eigen::Matrix<double, 2, 5> ApparentMotion(const Eigen::Vector2d& point, double height_m) {
  const double x = point.x();
  const double y = point.y();
  Eigen::Matrix<double, 2, 5> motion;
  motion << -1.0, 0.0, y, height_m + x * x / height_m, -x * y / height_m,  //
      0.0, -1.0, -x, x * y / height_m, -height_m - y * y / height_m;
  return motion;
}

PoseEstimate EstimatePose(const GroundCamera& camera, std::span<const GroundMatch> matches,
                          const MotionPrior& prior, const MotionOptions& options) {
  PoseEstimate estimate;
  estimate.inlier.assign(matches.size(), false);
  estimate.pose = prior.pose;
  if (matches.size() < static_cast<std::size_t>(options.min_inliers)) return estimate;

  // Where each match would lie if it is ground, and which of them are near enough to make
  // hypotheses: a pixel far away says nothing about translation.
  const GroundCamera leaning = Rocked(camera, prior.pose.pitch_rad, prior.pose.roll_rad);
  const GroundProjection project(leaning);
  std::vector<Eigen::Vector2d> seen(matches.size());
  std::vector<std::size_t> usable;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const auto point = leaning.GroundFromPixel(matches[i].pixel);
    if (!point) continue;
    seen[i] = *point;
    if (point->norm() < 12.0 * camera.height_m) usable.push_back(i);
  }
  if (usable.size() < static_cast<std::size_t>(options.min_inliers)) return estimate;

  // A lean that is not known yet misplaces all points a little; what has the same lean agrees all
  // the same within a wider tolerance.
  const double tolerance = kLeanAllowance * options.tolerance_px;
  BodyPose best = prior.pose;
  double best_cost = Cost(project, matches, best.frame_from_robot, tolerance);
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
    const double cost = Cost(project, matches, pose, tolerance);
    if (cost < best_cost) {
      best_cost = cost;
      best.frame_from_robot = pose;
    }
  }

  // The tolerance narrows from generous to fine, so that a rough hypothesis is drawn in first.
  NormalEquations equations;
  for (const double widening : {2.0 * kLeanAllowance, kLeanAllowance, 1.5, 1.0, 1.0, 1.0}) {
    equations = Linearise(camera, matches, best, widening * options.tolerance_px);
    equations.information += prior.information;
    equations.information.diagonal().array() += 1e-9;
    equations.gradient += prior.information * StepBetween(prior.pose, best);
    const Vector5d step = -equations.information.ldlt().solve(equations.gradient);
    if (!step.allFinite()) break;
    best = Moved(best, step);
  }

  const GroundProjection found(Rocked(camera, best.pitch_rad, best.roll_rad));
  const Pose2 robot_from_frame = best.frame_from_robot.Inverse();
  double squared = 0.0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const double error = NormalisedError(found, matches[i], robot_from_frame);
    if (error < options.tolerance_px) {
      estimate.inlier[i] = true;
      ++estimate.inliers;
      squared += error * error;
    }
  }
  estimate.pose = best;
  if (estimate.inliers < options.min_inliers) return estimate;
  // Spread of the residuals as found, so that a poor frame admits it.
  const double variance = std::max(squared / (2.0 * estimate.inliers - 5.0), 0.01);
  estimate.covariance =
      (prior.information + (equations.information - prior.information) / variance).inverse();
  const bool agreed =
      estimate.inliers >= options.min_inlier_ratio * static_cast<double>(usable.size());
  estimate.status = agreed ? MotionStatus::kOk : MotionStatus::kInconsistent;
  return estimate;
}

Eigen::Matrix3d BeforeFromNow(const GroundCamera& camera, const BodyPose& before,
                              const BodyPose& now, double height_ratio) {
  const Pose2 before_from_now = before.frame_from_robot.Inverse() * now.frame_from_robot;
  const double scale = 1.0 / (1.0 - height_ratio);
  const double c = std::cos(before_from_now.theta);
  const double s = std::sin(before_from_now.theta);
  Eigen::Matrix3d motion;
  motion << c, -s, scale * before_from_now.x,  //
      s, c, scale * before_from_now.y,         //
      0.0, 0.0, 1.0;
  const auto ground_from_image = [&](const BodyPose& pose) {
    return Rocked(camera, pose.pitch_rad, pose.roll_rad).ground_from_image;
  };
  return ground_from_image(before).inverse() * motion * ground_from_image(now);
}

HomographyCheck CheckHomography(std::span<const Eigen::Vector2d> before,
                                std::span<const Eigen::Vector2d> now,
                                const Eigen::Matrix3d& now_from_before, double tolerance_px) {
  HomographyCheck check;
  constexpr std::size_t kLeastMatches = 8;
  if (before.size() < kLeastMatches) return check;
  std::vector<cv::Point2d> from;
  std::vector<cv::Point2d> to;
  for (std::size_t i = 0; i < before.size(); ++i) {
    from.emplace_back(before[i].x(), before[i].y());
    to.emplace_back(now[i].x(), now[i].y());
  }
  cv::UsacParams params;
  params.threshold = tolerance_px;
  params.maxIterations = 200;
  params.score = cv::SCORE_METHOD_MAGSAC;
  params.loMethod = cv::LOCAL_OPTIM_SIGMA;
  std::vector<std::uint8_t> inlier;
  const cv::Mat found = cv::findHomography(from, to, inlier, params);
  if (found.empty()) return check;
  const Eigen::Matrix3d free =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(found.ptr<double>());
  std::vector<double> differences;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (inlier[i] == 0) continue;
    const Eigen::Vector3d point = before[i].homogeneous();
    differences.push_back(
        ((free * point).hnormalized() - (now_from_before * point).hnormalized()).norm());
  }
  if (differences.empty()) return check;
  check.explained = static_cast<int>(differences.size());
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  check.difference_px = *middle;
  return check;
}

}  // namespace beckon
