#include "services/ground_detector/alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "services/ground_detector/projection.hpp"

namespace beckon {
namespace {

constexpr int kLevels = 3;
constexpr int kIterations = 8;

struct Sample {
  Eigen::Vector2d point;  // on the ground, robot frame now
  float grey;
};

// Grey level and its gradient between pixels, bilinear; false at the border.
bool Interpolate(const cv::Mat& grey, double u, double v, Eigen::Vector3d& value) {
  const int column = static_cast<int>(std::floor(u));
  const int row = static_cast<int>(std::floor(v));
  if (column < 0 || row < 0 || column + 1 >= grey.cols || row + 1 >= grey.rows) return false;
  const double a = u - column;
  const double b = v - row;
  const auto* upper = grey.ptr<std::uint8_t>(row) + column;
  const auto* lower = grey.ptr<std::uint8_t>(row + 1) + column;
  const double top = upper[0] + a * (upper[1] - upper[0]);
  const double bottom = lower[0] + a * (lower[1] - lower[0]);
  value = {top + b * (bottom - top), (1.0 - b) * (upper[1] - upper[0]) + b * (lower[1] - lower[0]),
           bottom - top};
  return true;
}

std::vector<Sample> TakeSamples(const GroundCamera& camera, const cv::Mat& grey, double scale,
                                const cv::Mat& ground, int step, const AlignmentOptions& options) {
  std::vector<Sample> samples;
  for (int v = 1; v + 1 < grey.rows; v += step) {
    const auto* above = grey.ptr<std::uint8_t>(v - 1);
    const auto* row = grey.ptr<std::uint8_t>(v);
    const auto* below = grey.ptr<std::uint8_t>(v + 1);
    const auto* mask = ground.ptr<std::uint8_t>(v * ground.rows / grey.rows);
    for (int u = 1; u + 1 < grey.cols; u += step) {
      if (mask[u * ground.cols / grey.cols] == 0) continue;
      const float gradient = 0.5F * static_cast<float>(std::max(std::abs(row[u + 1] - row[u - 1]),
                                                                std::abs(below[u] - above[u])));
      if (gradient < options.least_gradient) continue;
      const Eigen::Vector2d pixel(scale * (u + 0.5) - 0.5, scale * (v + 0.5) - 0.5);
      const auto point = camera.GroundFromPixel(pixel);
      if (!point || point->norm() > options.max_range * camera.height_m) continue;
      samples.push_back({*point, static_cast<float>(row[u])});
    }
  }
  return samples;
}

// One Gauss-Newton problem: the pose, and a difference in brightness between the frames.
struct Problem {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  // Of the pose, what the information would be if all gradients were noise of unit variance.
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
  std::vector<double> residuals;  // absolute
};

Problem Linearise(const GroundProjection& project, const cv::Mat& before, double scale,
                  const std::vector<Sample>& samples, const Pose2& pose, double offset,
                  double sigma) {
  Problem problem;
  problem.residuals.reserve(samples.size());
  const double c = std::cos(pose.theta);
  const double s = std::sin(pose.theta);
  for (const Sample& sample : samples) {
    const Eigen::Vector2d turned(c * sample.point.x() - s * sample.point.y(),
                                 s * sample.point.x() + c * sample.point.y());
    Eigen::Vector2d pixel;
    Eigen::Matrix2d pixel_by_point;
    if (!project(turned + pose.translation(), pixel, pixel_by_point)) continue;
    Eigen::Vector3d value;
    if (!Interpolate(before, (pixel.x() + 0.5) / scale - 0.5, (pixel.y() + 0.5) / scale - 0.5,
                     value)) {
      continue;
    }
    const double residual = value.x() - sample.grey - offset;
    problem.residuals.push_back(std::abs(residual));
    // Huber's weight.
    const double weight = std::min(1.0, 1.345 * sigma / std::max(std::abs(residual), 1e-9));
    Eigen::Matrix<double, 2, 3> pixel_by_pose;
    pixel_by_pose << pixel_by_point, pixel_by_point * Eigen::Vector2d(-turned.y(), turned.x());
    pixel_by_pose /= scale;
    Eigen::Vector4d jacobian;
    jacobian << pixel_by_pose.transpose() * value.tail<2>(), -1.0;
    problem.noise += weight * pixel_by_pose.transpose() * pixel_by_pose;
    problem.information += weight * jacobian * jacobian.transpose();
    problem.gradient += weight * residual * jacobian;
  }
  return problem;
}

double MedianOf(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

GreyPyramid MakePyramid(const cv::Mat& grey) {
  GreyPyramid pyramid(kLevels);
  cv::resize(grey, pyramid[0], {}, 0.5, 0.5, cv::INTER_AREA);
  for (std::size_t level = 1; level < kLevels; ++level) {
    cv::resize(pyramid[level - 1], pyramid[level], {}, 0.5, 0.5, cv::INTER_AREA);
  }
  return pyramid;
}

Alignment AlignGround(const GroundCamera& camera, const GreyPyramid& now, const GreyPyramid& before,
                      const cv::Mat& ground, const Pose2& predicted, bool from_coarse,
                      const AlignmentOptions& options) {
  Alignment alignment;
  alignment.before_from_now = predicted;
  const GroundProjection project(camera);
  for (int level = from_coarse ? kLevels - 1 : 0; level >= 0; --level) {
    const auto index = static_cast<std::size_t>(level);
    const double scale = static_cast<double>(camera.width) / now[index].cols;
    const int step = 3 - level;
    const std::vector<Sample> samples =
        TakeSamples(camera, now[index], scale, ground, step, options);
    if (samples.size() < static_cast<std::size_t>(options.min_pixels >> (2 * level)))
      return alignment;
    Pose2& pose = alignment.before_from_now;
    double offset = 0.0;
    double sigma = 8.0;
    Problem problem;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      problem = Linearise(project, before[index], scale, samples, pose, offset, sigma);
      if (2 * problem.residuals.size() < samples.size()) return alignment;
      sigma = std::max(1.4826 * MedianOf(problem.residuals), 0.5);
      // A faint pull to where the motion is now keeps a direction without texture where it was.
      problem.information.diagonal() += Eigen::Vector4d(1.0, 1.0, 1.0, 1e-6);
      const Eigen::Vector4d change = -problem.information.ldlt().solve(problem.gradient);
      if (!change.allFinite()) return alignment;
      pose = {pose.x + change(0), pose.y + change(1), WrapAngle(pose.theta + change(2))};
      offset += change(3);
      if (change.head<2>().norm() < 1e-4 * camera.height_m && std::abs(change(2)) < 1e-4) break;
    }
    if (level > 0) continue;
    alignment.covariance = sigma * sigma * options.pixel_correlation *
                           Eigen::Matrix4d(problem.information.inverse()).topLeftCorner<3, 3>();
    // Residuals are the noise of two pixels, and so are gradients where there is nothing else: a
    // motion in which the information is no more than that is not known, however many pixels say
    // so.
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> directions(
        problem.information.topLeftCorner<3, 3>(), sigma * sigma * problem.noise);
    if (directions.eigenvalues().minCoeff() < options.least_signal) return alignment;
  }
  alignment.ok = true;
  return alignment;
}

}  // namespace beckon
