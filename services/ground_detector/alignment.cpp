#include "services/ground_detector/alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "common/label_runs.hpp"
#include "services/ground_detector/half_size.hpp"
#include "services/ground_detector/projection.hpp"

namespace beckon {
namespace {

constexpr int kLevels = 3;
constexpr int kIterations = 10;
constexpr std::size_t kReferences = 2;
constexpr int kPatchPx = 24;         // side of a patch at 1/2 size
constexpr double kPatchLimit = 2.0;  // significance, over the usual one, that excludes a patch

// Sobel's, grey levels a pixel. The pixel itself has no part in it, so that its noise has not.
Eigen::Vector2d Gradient(const cv::Mat& grey, int u, int v) {
  const auto* above = grey.ptr<std::uint8_t>(v - 1) + u;
  const auto* row = grey.ptr<std::uint8_t>(v) + u;
  const auto* below = grey.ptr<std::uint8_t>(v + 1) + u;
  const int across = above[1] - above[-1] + 2 * (row[1] - row[-1]) + below[1] - below[-1];
  const int along = below[-1] - above[-1] + 2 * (below[0] - above[0]) + below[1] - above[1];
  return 0.125 * Eigen::Vector2d(across, along);
}

// Gradient of a pixel as its surroundings bear it out: along an edge there is only noise, and where
// all edges run the same way, as in boards, its sum would say that nothing moves along them.
void SetGradient(const cv::Mat& grey, int u, int v, GroundSample& sample) {
  constexpr int kHalf = 2;
  constexpr double kCorner = 0.1;  // ratio of eigenvalues from which on there is no one edge
  constexpr double kAlongEdge = 1.0 / 16;  // of the noise, what the direction of an edge errs by
  sample.gradient = Gradient(grey, u, v);
  sample.noise_shape = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d tensor = Eigen::Matrix2d::Zero();
  for (int row = std::max(v - kHalf, 1); row <= std::min(v + kHalf, grey.rows - 2); ++row) {
    for (int column = std::max(u - kHalf, 1); column <= std::min(u + kHalf, grey.cols - 2);
         ++column) {
      const Eigen::Vector2d gradient = Gradient(grey, column, row);
      tensor += gradient * gradient.transpose();
    }
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> edges;
  edges.computeDirect(tensor);
  if (edges.eigenvalues()(0) > kCorner * edges.eigenvalues()(1)) return;
  const Eigen::Vector2d across = edges.eigenvectors().col(1);
  sample.gradient = across * across.dot(sample.gradient);
  sample.noise_shape =
      kAlongEdge * Eigen::Matrix2d::Identity() + (1.0 - kAlongEdge) * across * across.transpose();
}

// Ground that keeps away from its borders: beside a box the floor ends where the box hides it, and
// that edge is not on the floor.
cv::Mat InnerGround(const cv::Mat& labels) {
  cv::Mat ground = labels == kGround;
  cv::erode(ground, ground, cv::Mat::ones(5, 5, CV_8UC1), {-1, -1}, 1, cv::BORDER_CONSTANT,
            cv::Scalar(255));
  return ground;
}

// In each column the row where ground, followed from below, first ends at an obstacle; -1 for none.
std::vector<int> FootRows(const cv::Mat& labels) {
  std::vector<int> rows(static_cast<std::size_t>(labels.cols), -1);
  for (int u = 0; u < labels.cols; ++u) {
    int v = labels.rows - 1;
    while (v >= 0 && labels.at<std::uint8_t>(v, u) == kGround) --v;
    if (v < 0 || v == labels.rows - 1 || labels.at<std::uint8_t>(v, u) != kNotGround) continue;
    rows[static_cast<std::size_t>(u)] = v;
  }
  return rows;
}

// Visits the pixels of the foot lines: where the row of the foot jumps, something stands before
// something else, and the edge between them rises.
template <typename Visit>
void ForEachFootPixel(const cv::Mat& labels, const Visit& visit) {
  constexpr int kHalfBand = 1;
  constexpr int kSteepest = 2;  // rows from column to column
  const std::vector<int> rows = FootRows(labels);
  for (int u = 1; u + 1 < labels.cols; ++u) {
    const auto column = static_cast<std::size_t>(u);
    const int v = rows[column];
    if (v < 0 || std::abs(rows[column - 1] - v) > kSteepest ||
        std::abs(rows[column + 1] - v) > kSteepest) {
      continue;
    }
    const int top = std::max(v - kHalfBand, 1);
    const int bottom = std::min(v + 1 + kHalfBand, labels.rows - 2);
    for (int row = top; row <= bottom; ++row) visit(u, row);
  }
}

class SampleTaker {
 public:
  SampleTaker(const GroundCamera& camera, const cv::Mat& grey)
      : camera_(camera),
        grey_(grey),
        project_(camera),
        scale_(static_cast<double>(camera.width) / grey.cols) {}

  void Take(int u, int v, bool is_foot, double max_range_m,
            std::vector<GroundSample>& samples) const {
    const auto point =
        camera_.GroundFromPixel({scale_ * (u + 0.5) - 0.5, scale_ * (v + 0.5) - 0.5});
    if (!point || point->norm() > max_range_m) return;
    GroundSample sample;
    Eigen::Vector2d pixel;
    if (!project_(*point, pixel, sample.pixel_by_point)) return;
    sample.point = *point;
    SetGradient(grey_, u, v, sample);
    sample.pixel_by_point /= scale_;
    sample.grey = grey_.at<std::uint8_t>(v, u);
    const int side = std::max(cvRound(2.0 * kPatchPx / scale_), 1);
    const int across = grey_.cols / side + 1;
    // A foot line has patches of its own.
    sample.patch = 2 * (v / side * across + u / side) + (is_foot ? 1 : 0);
    samples.push_back(sample);
  }

 private:
  const GroundCamera& camera_;
  const cv::Mat& grey_;
  GroundProjection project_;
  double scale_;
};

// One Gauss-Newton problem: a step of the pose, and a difference in brightness for each reference.
constexpr int kUnknowns = 5 + static_cast<int>(kReferences);
using Vector7d = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix7d = Eigen::Matrix<double, kUnknowns, kUnknowns>;

struct Problem {
  Matrix7d information = Matrix7d::Zero();
  Vector7d gradient = Vector7d::Zero();
  // Of the pose, what the information would be if the gradients were noise of unit variance.
  Matrix5d noise = Matrix5d::Zero();
  std::vector<double> residuals;  // absolute, over their standard deviation at sigma
  double cost = 0.0;
};

// Difference in brightness from each reference to now, grey levels.
using Brightness = std::array<double, kReferences>;

// A sample that is seen again.
struct Sighting {
  const GroundSample* sample = nullptr;
  std::size_t reference = 0;
  double residual = 0.0;  // grey levels
  double variance = 0.0;  // that is expected of it
  Eigen::Matrix<double, 2, 5> pixel_by_pose;
};

std::vector<Sighting> SeeAgain(const GroundCamera& camera, const cv::Mat& grey,
                               std::span<const AlignmentReference> references, std::size_t level,
                               const BodyPose& pose, const Brightness& offsets, double sigma,
                               double edge_px) {
  const GroundProjection project(Rocked(camera, pose.pitch_rad, pose.roll_rad));
  const double scale = static_cast<double>(camera.width) / grey.cols;
  std::vector<Sighting> sightings;
  for (std::size_t r = 0; r < references.size(); ++r) {
    const Pose2 now_from_then = pose.frame_from_robot.Inverse() * references[r].frame_from_robot;
    const double c = std::cos(now_from_then.theta);
    const double s = std::sin(now_from_then.theta);
    Eigen::Matrix2d then_from_now;
    then_from_now << c, s, -s, c;
    for (const GroundSample& sample : (*references[r].texture)[level]) {
      const Eigen::Vector2d point = now_from_then * sample.point;
      Eigen::Vector2d pixel;
      double value;
      if (!project(point, pixel) || !Interpolate(grey, (pixel.x() + 0.5) / scale - 0.5,
                                                 (pixel.y() + 0.5) / scale - 0.5, value)) {
        continue;
      }
      const double blur = edge_px * sample.gradient.norm();
      // The gradient is the earlier frame's, whose noise has nothing to do with the residual.
      sightings.push_back(
          {&sample, r, value - sample.grey - offsets[r], sigma * sigma + blur * blur,
           sample.pixel_by_point * then_from_now * ApparentMotion(point, camera.height_m)});
    }
  }
  return sightings;
}

double MedianOf(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// How much each patch may say, 0 to 1. A patch that has moved by itself against the pose asked
// about, as reflections, highlights and shadows of the robot do, is left out, even if each of its
// pixels is too faint to tell: Tukey's function of the significance of its own displacement.
std::vector<double> PatchWeights(const std::vector<Sighting>& sightings) {
  struct Patch {
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  };
  int count = 0;
  for (const Sighting& seen : sightings) count = std::max(count, seen.sample->patch + 1);
  const auto per_reference = static_cast<std::size_t>(count);
  std::vector<Patch> patches(kReferences * per_reference);
  for (const Sighting& seen : sightings) {
    Patch& patch =
        patches[seen.reference * per_reference + static_cast<std::size_t>(seen.sample->patch)];
    const Eigen::Vector2d& gradient = seen.sample->gradient;
    patch.information += gradient * gradient.transpose() / seen.variance;
    patch.gradient += gradient * seen.residual / seen.variance;
  }
  std::vector<double> significance(patches.size(), 0.0);
  std::vector<double> some;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (patches[i].information.trace() <= 0.0) continue;
    const Eigen::Matrix2d information =
        patches[i].information +
        1e-3 * patches[i].information.trace() * Eigen::Matrix2d::Identity();
    significance[i] =
        std::sqrt(patches[i].gradient.dot(information.inverse() * patches[i].gradient));
    some.push_back(significance[i]);
  }
  // Neighbouring pixels err alike, so that even the best fit is "significant"; the usual is taken
  // as the measure.
  const double limit = some.empty() ? 1.0 : kPatchLimit * std::max(MedianOf(some), 1.0);
  std::vector<double> weights;
  weights.reserve(sightings.size());
  for (const Sighting& seen : sightings) {
    const double ratio = std::min(significance[seen.reference * per_reference +
                                               static_cast<std::size_t>(seen.sample->patch)] /
                                      limit,
                                  1.0);
    weights.push_back((1.0 - ratio * ratio) * (1.0 - ratio * ratio));
  }
  return weights;
}

Problem Linearise(const std::vector<Sighting>& sightings, double sigma, bool redescend) {
  Problem problem;
  const std::vector<double> patch_weights =
      redescend ? PatchWeights(sightings) : std::vector<double>(sightings.size(), 1.0);
  problem.residuals.reserve(sightings.size());
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const Sighting& seen = sightings[i];
    const double error = std::abs(seen.residual) / std::sqrt(seen.variance);
    problem.residuals.push_back(error);
    // At a fixed scale, so that fits compare.
    constexpr double kGrey = 1.5;
    const double excess = seen.variance - sigma * sigma;
    problem.cost += std::min(seen.residual * seen.residual / (kGrey * kGrey + excess), 9.0) /
                    static_cast<double>(sightings.size());
    // Huber's weight, or Tukey's.
    double weight = std::min(1.0, 1.345 / std::max(error, 1e-9));
    if (redescend) {
      const double ratio = std::min(error / 4.685, 1.0);
      weight = patch_weights[i] * (1.0 - ratio * ratio) * (1.0 - ratio * ratio);
    }
    weight /= seen.variance;
    Vector7d jacobian = Vector7d::Zero();
    jacobian.head<5>() = seen.pixel_by_pose.transpose() * seen.sample->gradient;
    jacobian(5 + static_cast<int>(seen.reference)) = -1.0;
    problem.information += weight * jacobian * jacobian.transpose();
    problem.gradient += weight * seen.residual * jacobian;
    problem.noise +=
        weight * seen.pixel_by_pose.transpose() * seen.sample->noise_shape * seen.pixel_by_pose;
  }
  return problem;
}

struct Measurement {
  Matrix5d information = Matrix5d::Zero();
  Vector5d gradient = Vector5d::Zero();
};

// What the problem says about the pose. Gradients are noisy as well (errors in variables): noise
// alone looks like information, and would say that nothing has moved. In the directions in which
// the information is that of noise, times a ratio, the share of noise is taken out.
Measurement WithoutNoise(const Problem& problem, double gradient_variance) {
  const Eigen::Matrix<double, 2, 2> offsets =
      problem.information.bottomRightCorner<2, 2>() + 1e-9 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix<double, 5, 2> mixed = problem.information.topRightCorner<5, 2>();
  const Eigen::Matrix<double, 5, 2> gain = mixed * offsets.inverse();
  const Matrix5d information = problem.information.topLeftCorner<5, 5>() - gain * mixed.transpose();
  const Vector5d gradient = problem.gradient.head<5>() - gain * problem.gradient.tail<2>();

  Matrix5d noise = gradient_variance * problem.noise;
  noise.diagonal() *= 1.0 + 1e-9;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix5d> directions(information, noise);
  const Matrix5d& vectors = directions.eigenvectors();  // transposed * noise * vectors = identity
  Vector5d kept;
  for (int i = 0; i < 5; ++i) {
    const double ratio = directions.eigenvalues()(i);
    kept(i) = ratio > 1.0 ? (ratio - 1.0) / ratio : 0.0;
  }
  const Matrix5d back = noise * vectors;  // inverse of vectors.transpose()
  Measurement measurement;
  measurement.information =
      back *
      (kept.array().square() * directions.eigenvalues().array().max(0.0)).matrix().asDiagonal() *
      back.transpose();
  measurement.gradient = back * kept.asDiagonal() * (vectors.transpose() * gradient);
  return measurement;
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

GroundTexture TakeGroundTexture(const GroundCamera& camera, const GreyPyramid& pyramid,
                                const cv::Mat& labels, const AlignmentOptions& options) {
  GroundTexture texture(pyramid.size());
  for (std::size_t level = 0; level < pyramid.size(); ++level) {
    const cv::Mat& grey = pyramid[level];
    const SampleTaker taker(camera, grey);
    cv::Mat small;
    cv::resize(labels, small, grey.size(), 0.0, 0.0, cv::INTER_NEAREST);
    const cv::Mat ground = InnerGround(small);
    const int side = std::max(options.cell_px >> level, 2);
    for (int top = 1; top + side < grey.rows; top += side) {
      for (int left = 1; left + side < grey.cols; left += side) {
        double most = options.least_gradient * options.least_gradient;
        cv::Point best(-1, -1);
        for (int v = top; v < top + side; ++v) {
          const auto* mask = ground.ptr<std::uint8_t>(v);
          for (int u = left; u < left + side; ++u) {
            if (mask[u] == 0) continue;
            const double squared = Gradient(grey, u, v).squaredNorm();
            if (squared < most) continue;
            most = squared;
            best = {u, v};
          }
        }
        if (best.x < 0) continue;
        taker.Take(best.x, best.y, false, options.max_range * camera.height_m, texture[level]);
      }
    }
    ForEachFootPixel(small, [&](int u, int v) {
      if (ground.at<std::uint8_t>(v, u) != 0) return;
      taker.Take(u, v, true, options.max_foot_range * camera.height_m, texture[level]);
    });
  }
  return texture;
}

Alignment AlignGround(const GroundCamera& camera, const GreyPyramid& now,
                      std::span<const AlignmentReference> references, const BodyPose& start,
                      const MotionPrior& prior, bool from_coarse, const AlignmentOptions& options) {
  Alignment alignment;
  BodyPose& pose = alignment.pose;
  pose = start;
  Brightness offsets{};
  double sigma = 8.0;
  for (int level = from_coarse ? kLevels - 1 : 0; level >= 0; --level) {
    const auto index = static_cast<std::size_t>(level);
    Measurement measurement;
    bool redescend = false;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      Problem problem = Linearise(
          SeeAgain(camera, now[index], references, index, pose, offsets, sigma, options.edge_px),
          sigma, redescend);
      alignment.samples = static_cast<int>(problem.residuals.size());
      alignment.cost = problem.cost;
      if (alignment.samples < options.min_samples >> (2 * level)) return alignment;
      // Half the variance of a residual is the noise of a pixel, of which Sobel's gradient has 0.19
      // parts; of what is left, samples were picked for having much of it.
      const double gradient_variance = 0.12 * sigma * sigma;
      measurement = WithoutNoise(problem, gradient_variance);
      measurement.information /= options.correlated_pixels;
      measurement.gradient /= options.correlated_pixels;
      const Matrix5d information = measurement.information + prior.information;
      const Vector5d gradient =
          measurement.gradient + prior.information * StepBetween(prior.pose, pose);
      const Vector5d step = -information.ldlt().solve(gradient);
      if (!step.allFinite()) return alignment;
      pose = Moved(pose, step);
      for (std::size_t r = 0; r < references.size(); ++r) {
        const auto row = 5 + static_cast<int>(r);
        const double curvature = problem.information(row, row);
        if (curvature <= 0.0) continue;
        offsets[r] -=
            (problem.gradient(row) + problem.information.row(row).head<5>().dot(step)) / curvature;
      }
      sigma = std::clamp(sigma * 1.4826 * MedianOf(problem.residuals), 0.5, 8.0);
      const bool settled = step.head<2>().norm() < 2e-4 * camera.height_m &&
                           step.tail<3>().cwiseAbs().maxCoeff() < 1e-4;
      if (settled && redescend) break;
      if (settled || iteration >= kIterations / 2) redescend = true;
    }
    if (level > 0) continue;
    alignment.covariance = (measurement.information + prior.information).inverse();
  }
  alignment.ok = true;
  return alignment;
}

}  // namespace beckon
