#include "services/rssi_localizer/residual_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace beckon {
namespace {

constexpr int kMaxBins = 150;  // solving takes the cube of it
constexpr double kMaxReadingsPerBin = 4.0;

struct Binned {
  std::vector<Eigen::Vector2d> places;
  std::vector<double> means;
  std::vector<double> counts;
  std::vector<std::size_t> bin_of;  // per residual
};

Binned Bin(std::span<const Residual> residuals, double side_m) {
  Binned binned;
  std::map<std::pair<long, long>, std::size_t> known;
  for (const Residual& residual : residuals) {
    const std::pair<long, long> key(std::lround(std::floor(residual.position.x() / side_m)),
                                    std::lround(std::floor(residual.position.y() / side_m)));
    const auto [entry, is_new] = known.emplace(key, binned.places.size());
    if (is_new) {
      binned.places.emplace_back(Eigen::Vector2d::Zero());
      binned.means.push_back(0.0);
      binned.counts.push_back(0.0);
    }
    const std::size_t bin = entry->second;
    binned.places[bin] += residual.position;
    binned.means[bin] += residual.residual_db;
    binned.counts[bin] += 1.0;
    binned.bin_of.push_back(bin);
  }
  for (std::size_t bin = 0; bin < binned.places.size(); ++bin) {
    binned.places[bin] /= binned.counts[bin];
    binned.means[bin] /= binned.counts[bin];
  }
  return binned;
}

}  // namespace

double ResidualMap::Covariance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
  return kernel_.amplitude_db * kernel_.amplitude_db * std::exp(-(a - b).norm() / kernel_.length_m);
}

ResidualMap::ResidualMap(std::span<const Residual> residuals, const ResidualKernel& kernel)
    : kernel_(kernel) {
  double side_m = 0.5;
  Binned binned = Bin(residuals, side_m);
  while (binned.places.size() > kMaxBins) binned = Bin(residuals, side_m *= 1.5);
  places_ = binned.places;
  const auto n = static_cast<Eigen::Index>(places_.size());
  if (n == 0) return;

  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      covariance(i, j) = covariance(j, i) =
          Covariance(places_[static_cast<std::size_t>(i)], places_[static_cast<std::size_t>(j)]);
    }
    const double readings =
        std::min(binned.counts[static_cast<std::size_t>(i)], kMaxReadingsPerBin);
    covariance(i, i) += kernel_.noise_db * kernel_.noise_db / readings;
  }
  factor_.compute(covariance);
  const Eigen::Map<const Eigen::VectorXd> means(binned.means.data(), n);
  weights_ = factor_.solve(means);

  // Leave-one-out in closed form: Rasmussen and Williams, Gaussian Processes for Machine Learning,
  // (5.12).
  const Eigen::MatrixXd inverse = factor_.solve(Eigen::MatrixXd::Identity(n, n));
  std::vector<Value> bin_left_out(places_.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto bin = static_cast<std::size_t>(i);
    const double variance = 1.0 / inverse(i, i);
    const double off = weights_[i] * variance;
    const double noise =
        kernel_.noise_db * kernel_.noise_db / std::min(binned.counts[bin], kMaxReadingsPerBin);
    bin_left_out[bin] = {binned.means[bin] - off, std::max(0.0, variance - noise)};
    log_score_ -= 0.5 * (std::log(2.0 * std::numbers::pi * variance) + off * off / variance);
  }
  left_out_.reserve(residuals.size());
  for (const std::size_t bin : binned.bin_of) left_out_.push_back(bin_left_out[bin]);
}

ResidualMap::Value ResidualMap::At(const Eigen::Vector2d& position) const {
  const double prior = kernel_.amplitude_db * kernel_.amplitude_db;
  if (places_.empty()) return {0.0, prior};
  Eigen::VectorXd covariance(static_cast<Eigen::Index>(places_.size()));
  for (std::size_t i = 0; i < places_.size(); ++i) {
    covariance[static_cast<Eigen::Index>(i)] = Covariance(places_[i], position);
  }
  const Eigen::VectorXd half = factor_.matrixL().solve(covariance);
  return {covariance.dot(weights_), std::max(0.0, prior - half.squaredNorm())};
}

ResidualKernel FitResidualKernel(const std::vector<std::vector<Residual>>& by_beacon,
                                 double sd_db) {
  // Three numbers do not need all beacons.
  constexpr std::size_t kMostBeacons = 8;
  std::vector<const std::vector<Residual>*> beacons;
  for (const std::vector<Residual>& residuals : by_beacon) beacons.push_back(&residuals);
  std::stable_sort(beacons.begin(), beacons.end(),
                   [](const auto* a, const auto* b) { return a->size() > b->size(); });
  beacons.resize(std::min(beacons.size(), kMostBeacons));

  ResidualKernel best;
  double best_score = -std::numeric_limits<double>::infinity();
  for (const double length_m : {0.7, 1.5, 3.0, 6.0}) {
    for (const double explained : {0.2, 0.4, 0.6, 0.8}) {
      const ResidualKernel kernel{sd_db * std::sqrt(explained), length_m,
                                  sd_db * std::sqrt(1.0 - explained)};
      double score = 0.0;
      for (const std::vector<Residual>* residuals : beacons) {
        score += ResidualMap(*residuals, kernel).log_score();
      }
      if (score > best_score) {
        best_score = score;
        best = kernel;
      }
    }
  }
  return best;
}

}  // namespace beckon
