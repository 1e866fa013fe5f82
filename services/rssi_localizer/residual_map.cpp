#include "services/rssi_localizer/residual_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace beckon {
namespace {

constexpr double kBinM = 0.5;
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

// What lies in the given number of bins around the middle of all.
std::vector<Residual> Middle(std::span<const Residual> residuals, std::size_t bins) {
  const Binned binned = Bin(residuals, kBinM);
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& place : binned.places) {
    middle += place / static_cast<double>(binned.places.size());
  }
  std::vector<std::size_t> order(binned.places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return (binned.places[a] - middle).squaredNorm() < (binned.places[b] - middle).squaredNorm();
  });
  std::vector<char> kept(order.size(), 0);
  for (std::size_t i = 0; i < std::min(bins, order.size()); ++i) kept[order[i]] = 1;
  std::vector<Residual> of_middle;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (kept[binned.bin_of[i]] != 0) of_middle.push_back(residuals[i]);
  }
  return of_middle;
}

}  // namespace

double ResidualMap::Covariance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
  return kernel_.amplitude_db * kernel_.amplitude_db * std::exp(-(a - b).norm() / kernel_.length_m);
}

ResidualMap::ResidualMap(std::span<const Residual> residuals, const ResidualKernel& kernel,
                         std::size_t max_bins)
    : kernel_(kernel) {
  double side_m = kBinM;
  Binned binned = Bin(residuals, side_m);
  while (binned.places.size() > max_bins) binned = Bin(residuals, side_m *= 1.2);
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
    left_out_log_variance_ += std::log(variance);
    left_out_squares_ += off * off / variance;
  }
  left_out_.reserve(residuals.size());
  for (const std::size_t bin : binned.bin_of) left_out_.push_back(bin_left_out[bin]);
}

ResidualMap::Value ResidualMap::At(const Eigen::Vector2d& position) const {
  return At(std::span(&position, 1)).front();
}

std::vector<ResidualMap::Value> ResidualMap::At(std::span<const Eigen::Vector2d> positions) const {
  const double prior = kernel_.amplitude_db * kernel_.amplitude_db;
  std::vector<Value> values(positions.size(), {0.0, prior});
  if (places_.empty()) return values;
  constexpr std::size_t kAtOnce = 256;  // columns, so that they stay in the cache
  for (std::size_t first = 0; first < positions.size(); first += kAtOnce) {
    const auto part = positions.subspan(first, std::min(kAtOnce, positions.size() - first));
    Eigen::MatrixXd covariance(static_cast<Eigen::Index>(places_.size()),
                               static_cast<Eigen::Index>(part.size()));
    for (Eigen::Index column = 0; column < covariance.cols(); ++column) {
      for (Eigen::Index row = 0; row < covariance.rows(); ++row) {
        covariance(row, column) = Covariance(places_[static_cast<std::size_t>(row)],
                                             part[static_cast<std::size_t>(column)]);
      }
    }
    const Eigen::VectorXd mean = covariance.transpose() * weights_;
    factor_.matrixL().solveInPlace(covariance);
    const Eigen::VectorXd known = covariance.colwise().squaredNorm();
    for (std::size_t i = 0; i < part.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      values[first + i] = {mean[column], std::max(0.0, prior - known[column])};
    }
  }
  return values;
}

ResidualKernel FitResidualKernel(const std::vector<std::vector<Residual>>& by_beacon,
                                 double sd_db) {
  // Three numbers need neither all beacons nor all places.
  constexpr std::size_t kMostBeacons = 8;
  constexpr std::size_t kMostBins = 150;
  std::vector<std::vector<Residual>> beacons = by_beacon;
  std::stable_sort(beacons.begin(), beacons.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  beacons.resize(std::min(beacons.size(), kMostBeacons));
  for (std::vector<Residual>& residuals : beacons) residuals = Middle(residuals, kMostBins);

  ResidualKernel best;
  double best_score = -std::numeric_limits<double>::infinity();
  for (const double length_m : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    for (const double explained : {0.2, 0.4, 0.6, 0.8, 0.9, 0.95}) {
      ResidualKernel kernel{std::sqrt(explained), length_m, std::sqrt(1.0 - explained)};
      double bins = 0.0;
      double log_variance = 0.0;
      double squares = 0.0;
      for (const std::vector<Residual>& residuals : beacons) {
        const ResidualMap map(residuals, kernel);
        bins += map.bins();
        log_variance += map.left_out_log_variance();
        squares += map.left_out_squares();
      }
      // A covariance n times as large leaves the predictions and makes the variances n times as
      // large; the likeliest n is the mean square. Where nothing was measured the map knows no more
      // than distance does, and all that residuals have shown may be there: n is at least that.
      const double scale = std::max(sd_db * sd_db, squares / std::max(1.0, bins));
      const double score = -log_variance - bins * std::log(scale) - squares / scale;
      if (score > best_score) {
        best_score = score;
        kernel.amplitude_db *= std::sqrt(scale);
        kernel.noise_db *= std::sqrt(scale);
        best = kernel;
      }
    }
  }
  return best;
}

}  // namespace beckon
