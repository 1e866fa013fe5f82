#include "services/rssi_localizer/posterior.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace beckon {
namespace {

std::vector<int> ByFallingProbability(std::span<const float> probability) {
  std::vector<int> order(probability.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return probability[static_cast<std::size_t>(a)] > probability[static_cast<std::size_t>(b)];
  });
  return order;
}

}  // namespace

void NormaliseLog(CellValues& log_probability) {
  float greatest = -std::numeric_limits<float>::infinity();
  for (const float value : log_probability) {
    if (std::isnan(value)) throw std::invalid_argument("a log-probability is not a number");
    greatest = std::max(greatest, value);
  }
  if (std::isinf(greatest)) throw std::invalid_argument("no cell has a probability above zero");
  double sum = 0.0;
  for (float& value : log_probability) {
    value = std::exp(value - greatest);
    sum += value;
  }
  const float scale = static_cast<float>(1.0 / sum);
  for (float& value : log_probability) value *= scale;
}

Estimate Summarise(const FloorGrid& grid, std::span<const float> probability) {
  Estimate estimate;
  for (std::size_t cell = 0; cell < probability.size(); ++cell) {
    estimate.mean += static_cast<double>(probability[cell]) * grid.centres()[cell];
  }
  for (std::size_t cell = 0; cell < probability.size(); ++cell) {
    const Eigen::Vector2d off = grid.centres()[cell] - estimate.mean;
    estimate.covariance += static_cast<double>(probability[cell]) * off * off.transpose();
  }
  estimate.covariance(1, 0) = estimate.covariance(0, 1);
  estimate.covariance += grid.cell_area_m2() / 12.0 * Eigen::Matrix2d::Identity();

  // Selecting the likeliest cells needs no full sort: most of the probability is in few of them.
  std::vector<float> values(probability.begin(), probability.end());
  double held = 0.0;
  std::size_t taken = 0;
  std::size_t block = 64;
  while (taken < values.size() && held < 0.9) {
    const std::size_t end = std::min(values.size(), taken + block);
    std::partial_sort(values.begin() + static_cast<std::ptrdiff_t>(taken),
                      values.begin() + static_cast<std::ptrdiff_t>(end), values.end(),
                      std::greater<>());
    while (taken < end && held < 0.9) held += static_cast<double>(values[taken++]);
    block *= 4;
  }
  estimate.area_90_m2 = static_cast<double>(taken) * grid.cell_area_m2();
  return estimate;
}

CellValues CredibleLevels(std::span<const float> probability) {
  CellValues level(probability.size());
  double held = 0.0;
  for (const int cell : ByFallingProbability(probability)) {
    level[static_cast<std::size_t>(cell)] = static_cast<float>(std::min(held, 1.0));
    held += static_cast<double>(probability[static_cast<std::size_t>(cell)]);
  }
  return level;
}

}  // namespace beckon
