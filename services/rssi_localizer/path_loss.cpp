#include "services/rssi_localizer/path_loss.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace beckon {

double PathLoss::MeanRssi(double distance_m) const {
  return rssi_at_1m_dbm - 10.0 * exponent * std::log10(std::max(distance_m, kMinDistanceM));
}

double PathLoss::MeanRssi(int beacon, double distance_m, double walls_crossed) const {
  const double offset = offset_db.empty() ? 0.0 : offset_db[static_cast<std::size_t>(beacon)];
  return MeanRssi(distance_m) + offset - wall_db * walls_crossed;
}

double PathLoss::Distance(double rssi_dbm) const {
  return std::pow(10.0, (rssi_at_1m_dbm - rssi_dbm) / (10.0 * exponent));
}

PathLoss FitPathLoss(std::span<const CalibrationSample> samples, int beacons,
                     std::span<const double> walls_crossed, const PathLossFitOptions& options) {
  if (samples.empty()) return options.prior;
  // Unknowns: RSSI at 1 m, exponent, [attenuation of a wall], [offset of each beacon].
  const bool walls = !walls_crossed.empty();
  const int first_offset = walls ? 3 : 2;
  const int unknowns = first_offset + (options.fit_offsets ? beacons : 0);
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(unknowns);
  Eigen::VectorXd spread = Eigen::VectorXd::Constant(unknowns, options.offset_sd_db);
  expected[0] = options.prior.rssi_at_1m_dbm;
  spread[0] = options.rssi_at_1m_sd_db;
  expected[1] = options.prior.exponent;
  spread[1] = options.exponent_sd;
  if (walls) {
    expected[2] = options.prior.wall_db;
    spread[2] = options.wall_sd_db;
  }

  // Four unknowns at most have a say in one reading, however many beacons there are.
  struct Term {
    int unknown;
    double factor;
  };
  std::vector<std::vector<Term>> equations;
  equations.reserve(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    std::vector<Term>& terms = equations.emplace_back();
    terms = {{0, 1.0}, {1, -10.0 * std::log10(samples[i].distance_m)}};
    if (walls) terms.push_back({2, -walls_crossed[i]});
    if (options.fit_offsets) terms.push_back({first_offset + samples[i].beacon, 1.0});
  }

  constexpr double kDegreesOfFreedom = 4.0;
  constexpr int kMaxIterations = 25;
  constexpr double kConverged = 1e-4;  // dB
  Eigen::VectorXd solution = expected;
  std::vector<double> residual(samples.size(), 0.0);
  double variance = options.prior.sd_db * options.prior.sd_db;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    Eigen::MatrixXd normal = spread.array().inverse().square().matrix().asDiagonal();
    Eigen::VectorXd right = expected.cwiseQuotient(spread.cwiseAbs2());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      // The first round has no residuals yet and weighs all alike.
      const double t_weight = iteration == 0
                                  ? 1.0
                                  : (kDegreesOfFreedom + 1.0) /
                                        (kDegreesOfFreedom + residual[i] * residual[i] / variance);
      const double weight = samples[i].weight * t_weight / variance;
      for (const Term& row : equations[i]) {
        for (const Term& column : equations[i]) {
          normal(row.unknown, column.unknown) += weight * row.factor * column.factor;
        }
        right[row.unknown] += weight * samples[i].rssi_dbm * row.factor;
      }
    }
    const Eigen::VectorXd previous = std::exchange(solution, normal.ldlt().solve(right));
    double squares = 0.0;
    double weights = 0.0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      residual[i] = samples[i].rssi_dbm;
      for (const Term& term : equations[i]) residual[i] -= term.factor * solution[term.unknown];
      // Winsorised, so that the spread is that of the bulk and the tail is the tail's affair.
      const double limit = 9.0 * variance;
      squares += samples[i].weight * std::min(residual[i] * residual[i], limit);
      weights += samples[i].weight;
    }
    // As good as two readings of the expected spread: a perfect fit to three points proves nothing.
    constexpr double kPriorWeight = 2.0;
    const double prior_variance = options.prior.sd_db * options.prior.sd_db;
    const double previous_variance = std::exchange(
        variance, (squares + kPriorWeight * prior_variance) / (weights + kPriorWeight));
    if ((solution - previous).cwiseAbs().maxCoeff() < kConverged &&
        std::abs(variance - previous_variance) < kConverged) {
      break;
    }
  }

  PathLoss fit;
  fit.rssi_at_1m_dbm = solution[0];
  // Signals do not grow with distance; between 1 (corridors guide waves) and 6 lies all that is
  // reported.
  fit.exponent = std::clamp(solution[1], 1.0, 6.0);
  fit.wall_db = walls ? std::max(0.0, solution[2]) : 0.0;
  fit.sd_db = std::sqrt(variance);
  if (options.fit_offsets) {
    fit.offset_db.assign(solution.data() + first_offset, solution.data() + unknowns);
  }
  return fit;
}

WallCounter::WallCounter(const FloorPlan& plan) : walls_(plan.walls) {
  for (std::size_t i = 0; i < plan.outline.size(); ++i) {
    walls_.push_back({plan.outline[i], plan.outline[(i + 1) % plan.outline.size()], std::nullopt});
  }
}

double WallCounter::Crossed(const Eigen::Vector2d& beacon, const Eigen::Vector2d& tag) const {
  constexpr double kDrawnInM = 0.05;
  const Eigen::Vector2d line = tag - beacon;
  const double length = line.norm();
  if (length <= 2.0 * kDrawnInM) return 0.0;
  const Eigen::Vector2d step = kDrawnInM / length * line;
  int crossed = 0;
  for (const Wall& wall : walls_) {
    if (SegmentsMeet(beacon + step, tag - step, wall.from, wall.to)) ++crossed;
  }
  return crossed;
}

}  // namespace beckon
