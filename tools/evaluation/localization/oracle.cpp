#include "tools/evaluation/localization/oracle.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <map>

#include "common/config.hpp"
#include "services/rssi_localizer/path_loss.hpp"

namespace beckon {
namespace {

constexpr int kMaxCells = 2500;  // half a metre in the largest of the places

}  // namespace

Oracle::Oracle(const Site& site, const CalibrationSet& calibration,
               const std::filesystem::path& file)
    : grid_(site.plan, {.resolution_m = 0.25, .max_cells = kMaxCells}) {
  ConfigFile config(file);
  ConfigTable& radio = config.Table("radio");
  PathLoss path_loss;
  double shadowing_sd_db = 0.0;
  double decorrelation_m = 0.0;
  radio.Required("rssi_at_1m_dbm", path_loss.rssi_at_1m_dbm);
  radio.Required("exponent", path_loss.exponent);
  radio.Required("wall_db", path_loss.wall_db);
  radio.Required("shadowing_sd_db", shadowing_sd_db, AtLeast(0.0));
  radio.Required("decorrelation_m", decorrelation_m, AtLeast(0.01));
  radio.Required("fading_sd_db", fading_sd_db_, AtLeast(0.01));
  radio.Required("quantum_db", quantum_db_, AtLeast(0.0));
  config.Finish();

  const WallCounter walls(site.plan);
  const auto expected = [&](const Beacon& beacon, const Eigen::Vector2d& at) {
    return path_loss.MeanRssi(0, BeaconDistance(beacon, site.tag_height_m, at),
                              walls.Crossed(beacon.position.head<2>(), at));
  };
  const auto covariance = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return shadowing_sd_db * shadowing_sd_db * std::exp(-(a - b).norm() / decorrelation_m);
  };
  const auto beacons = static_cast<Eigen::Index>(site.beacons.size());
  expected_dbm_.resize(grid_.size(), beacons);
  variance_db2_.setConstant(grid_.size(), beacons, shadowing_sd_db * shadowing_sd_db);
  for (Eigen::Index b = 0; b < beacons; ++b) {
    const Beacon& beacon = site.beacons[static_cast<std::size_t>(b)];
    for (Eigen::Index cell = 0; cell < grid_.size(); ++cell) {
      expected_dbm_(cell, b) = expected(beacon, grid_.centres()[static_cast<std::size_t>(cell)]);
    }
    std::vector<const CalibrationSample*> samples;
    for (const CalibrationSample& sample : calibration.samples) {
      if (sample.beacon == b) samples.push_back(&sample);
    }
    const auto n = static_cast<Eigen::Index>(samples.size());
    if (n == 0) continue;
    Eigen::MatrixXd among(n, n);
    Eigen::VectorXd residual(n);
    Eigen::MatrixXd to_cells(n, grid_.size());
    for (Eigen::Index i = 0; i < n; ++i) {
      const CalibrationSample& sample = *samples[static_cast<std::size_t>(i)];
      residual[i] = sample.rssi_dbm - expected(beacon, sample.position);
      for (Eigen::Index j = 0; j < n; ++j) {
        among(i, j) = covariance(sample.position, samples[static_cast<std::size_t>(j)]->position);
      }
      among(i, i) += ReadingVariance(sample.readings);
      for (Eigen::Index cell = 0; cell < grid_.size(); ++cell) {
        to_cells(i, cell) =
            covariance(sample.position, grid_.centres()[static_cast<std::size_t>(cell)]);
      }
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(among);
    expected_dbm_.col(b) += to_cells.transpose() * factor.solve(residual);
    const Eigen::MatrixXd half = factor.matrixL().solve(to_cells);
    variance_db2_.col(b) -= half.colwise().squaredNorm().transpose();
  }
}

double Oracle::ReadingVariance(double readings) const {
  return (fading_sd_db_ * fading_sd_db_ + quantum_db_ * quantum_db_ / 12.0) / readings;
}

CellValues Oracle::Probability(const std::vector<BeaconReading>& readings) const {
  std::map<int, int> count;
  for (const BeaconReading& reading : readings) ++count[reading.beacon];
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(grid_.size());
  for (const auto& [beacon, rssi] : MeanPerBeacon(readings, Averaging::kDecibels)) {
    const Eigen::ArrayXd variance =
        variance_db2_.col(beacon).array().max(0.0) + ReadingVariance(count[beacon]);
    sum -= 0.5 * ((rssi - expected_dbm_.col(beacon).array()).square() / variance + variance.log());
  }
  CellValues probability(static_cast<std::size_t>(grid_.size()));
  for (std::size_t cell = 0; cell < probability.size(); ++cell) {
    probability[cell] = static_cast<float>(sum[static_cast<Eigen::Index>(cell)] - sum.maxCoeff());
  }
  NormaliseLog(probability);
  return probability;
}

}  // namespace beckon
