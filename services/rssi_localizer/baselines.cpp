#include "services/rssi_localizer/baselines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace beckon {
namespace {

constexpr std::array<double, 32> kCc2431Exponents = {
    1.0,   1.25,  1.5,   1.75,  1.875, 2.0,   2.125, 2.25,  2.375, 2.5,   2.625,
    2.75,  2.875, 3.0,   3.125, 3.25,  3.375, 3.5,   3.625, 3.75,  3.875, 4.0,
    4.125, 4.25,  4.375, 4.5,   4.625, 5.0,   5.5,   6.0,   7.0,   8.0};

constexpr double kLeastA = 30.0;
constexpr double kGreatestA = 50.0;

double InHalfDb(double value) { return std::round(2.0 * value) / 2.0; }

// The hardware's parameters (A, n) that fit the calibration best; they need not be the rounded ones
// of the free fit where that leaves the hardware's range.
std::pair<double, double> FitCc2431(const CalibrationSet& calibration, const PathLoss& prior) {
  std::pair<double, double> best{std::clamp(InHalfDb(-prior.rssi_at_1m_dbm), kLeastA, kGreatestA),
                                 kCc2431Exponents.front()};
  double least = std::numeric_limits<double>::infinity();
  for (const double n : kCc2431Exponents) {
    if (calibration.samples.empty()) {
      if (std::abs(n - prior.exponent) < std::abs(best.second - prior.exponent)) best.second = n;
      continue;
    }
    // For a given n the squares are a parabola in A.
    double sum = 0.0;
    double squares = 0.0;
    double weights = 0.0;
    for (const CalibrationSample& sample : calibration.samples) {
      const double a = -sample.rssi_dbm - 10.0 * n * std::log10(sample.distance_m);
      sum += sample.weight * a;
      squares += sample.weight * a * a;
      weights += sample.weight;
    }
    const double a = std::clamp(InHalfDb(sum / weights), kLeastA, kGreatestA);
    const double error = squares - 2.0 * a * sum + a * a * weights;
    if (error < least) {
      least = error;
      best = {a, n};
    }
  }
  return best;
}

}  // namespace

Baselines::Baselines(const FloorGrid& grid, const Site& site, const CalibrationSet& calibration,
                     const std::vector<CalibrationReading>& readings, const PathLoss& prior)
    : grid_(grid), site_(site) {
  const int beacons = static_cast<int>(site.beacons.size());
  PathLossFitOptions options;
  options.prior = prior;
  options.fit_offsets = false;
  path_loss_ = FitPathLoss(calibration.samples, beacons, {}, options);

  cc2431_ = FitCc2431(calibration, prior);

  area_centre_ = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& centre : grid.centres()) area_centre_ += centre / grid.size();

  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(beacons, beacons);
  Eigen::MatrixXd count = Eigen::MatrixXd::Zero(beacons, beacons);
  for (const CalibrationReading& reading : readings) {
    const int a = site.BeaconIndex(reading.reading.beacon);
    const int b = site.BeaconIndex(reading.reading.tag);
    if (a < 0 || b < 0 || !IsPlausibleRssi(reading.reading.rssi_dbm)) continue;
    // A link is the same both ways but for the two radios.
    for (const auto& [row, column] : {std::pair(a, b), std::pair(b, a)}) {
      sum(row, column) += reading.reading.rssi_dbm;
      count(row, column) += 1.0;
    }
  }
  beacon_rssi_.resize(beacons, beacons);
  for (int a = 0; a < beacons; ++a) {
    for (int b = 0; b < beacons; ++b) {
      const double distance_m = (site.beacons[static_cast<std::size_t>(a)].position -
                                 site.beacons[static_cast<std::size_t>(b)].position)
                                    .norm();
      beacon_rssi_(a, b) =
          count(a, b) > 0.0 ? sum(a, b) / count(a, b) : path_loss_.MeanRssi(distance_m);
    }
  }
}

double Baselines::PlanarDistance(int beacon, double rssi_dbm) const {
  const double height =
      site_.beacons[static_cast<std::size_t>(beacon)].position.z() - site_.tag_height_m;
  const double distance = path_loss_.Distance(rssi_dbm);
  return std::sqrt(std::max(distance * distance - height * height, 0.0));
}

Eigen::Vector2d Baselines::WeightedCentroid(const Heard& heard) const {
  if (heard.empty()) return area_centre_;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weights = 0.0;
  for (const auto& [beacon, rssi] : heard) {
    const double weight = std::pow(10.0, rssi / 10.0);
    sum += weight * site_.beacons[static_cast<std::size_t>(beacon)].position.head<2>();
    weights += weight;
  }
  return sum / weights;
}

Eigen::Vector2d Baselines::MinMax(const Heard& heard) const {
  if (heard.empty()) return area_centre_;
  Eigen::Array2d low = Eigen::Array2d::Constant(-std::numeric_limits<double>::infinity());
  Eigen::Array2d high = -low;
  for (const auto& [beacon, rssi] : heard) {
    const Eigen::Array2d at = site_.beacons[static_cast<std::size_t>(beacon)].position.head<2>();
    const double distance = PlanarDistance(beacon, rssi);
    low = low.max(at - distance);
    high = high.min(at + distance);
  }
  return 0.5 * (low + high).matrix();
}

Eigen::Vector2d Baselines::Rocrssi(const Heard& heard) const {
  std::vector<int> rings(grid_.centres().size(), 0);
  for (const auto& [a, rssi] : heard) {
    const Eigen::Vector2d at = site_.beacons[static_cast<std::size_t>(a)].position.head<2>();
    double inner = 0.0;
    double outer = std::numeric_limits<double>::infinity();
    for (int b = 0; b < static_cast<int>(site_.beacons.size()); ++b) {
      if (b == a) continue;
      const double distance =
          (site_.beacons[static_cast<std::size_t>(b)].position.head<2>() - at).norm();
      if (beacon_rssi_(a, b) > rssi) {
        inner = std::max(inner, distance);
      } else {
        outer = std::min(outer, distance);
      }
    }
    if (inner >= outer) continue;
    for (std::size_t cell = 0; cell < rings.size(); ++cell) {
      const double distance = (grid_.centres()[cell] - at).norm();
      if (distance >= inner && distance <= outer) ++rings[cell];
    }
  }
  const int most = *std::max_element(rings.begin(), rings.end());
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int cells = 0;
  for (std::size_t cell = 0; cell < rings.size(); ++cell) {
    if (rings[cell] != most) continue;
    sum += grid_.centres()[cell];
    ++cells;
  }
  return sum / cells;
}

Eigen::Vector2d Baselines::Cc2431(const Heard& heard) const {
  constexpr std::size_t kFewestNodes = 3;
  constexpr std::size_t kMostNodes = 16;
  constexpr double kGridM = 0.25;
  if (heard.size() < kFewestNodes) return area_centre_;
  Heard nodes = heard;
  std::sort(nodes.begin(), nodes.end(),
            [](const auto& a, const auto& b) { return a.second > b.second; });
  nodes.resize(std::min(nodes.size(), kMostNodes));

  const auto [a, n] = cc2431_;
  const Eigen::Vector2d min = site_.plan.min;
  const Eigen::Vector2d max = site_.plan.max;
  Eigen::Vector2d best = area_centre_;
  double least = std::numeric_limits<double>::infinity();
  for (double y = min.y(); y <= max.y() + 1e-9; y += kGridM) {
    for (double x = min.x(); x <= max.x() + 1e-9; x += kGridM) {
      double squares = 0.0;
      for (const auto& [beacon, rssi] : nodes) {
        const Eigen::Vector2d at =
            site_.beacons[static_cast<std::size_t>(beacon)].position.head<2>();
        const double distance = std::max(kGridM / 2.0, (at - Eigen::Vector2d(x, y)).norm());
        const double expected = -a - 10.0 * n * std::log10(distance);
        const double off = std::clamp(InHalfDb(rssi), -95.0, -40.0) - expected;
        squares += off * off;
      }
      if (squares < least) {
        least = squares;
        best = {x, y};
      }
    }
  }
  return best;
}

}  // namespace beckon
