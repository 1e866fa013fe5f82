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

// Number of values, of those given and `others` times `other`, that hold `fraction` in all: the
// largest first. Halves the candidates again and again, so it takes linear time.
double SmallestSet(std::vector<float> values, int others, double other, double fraction) {
  // Those below the shared value come after it.
  const auto above = std::partition(values.begin(), values.end(), [&](float value) {
    return static_cast<double>(value) >= other;
  });
  double taken = 0.0;
  const auto take = [&](auto first, auto last) {
    while (last - first > 1) {
      const auto middle = first + (last - first) / 2;
      std::nth_element(first, middle, last, std::greater<>());
      const double upper = std::accumulate(first, middle, 0.0);
      if (upper < fraction) {
        fraction -= upper;
        taken += static_cast<double>(middle - first);
        first = middle;
      } else {
        last = middle;
      }
    }
    if (first == last) return;
    fraction -= static_cast<double>(*first);
    ++taken;
  };
  take(values.begin(), above);
  if (fraction <= 0.0) return taken;
  if (others > 0 && other > 0.0) {
    const double needed = std::min(static_cast<double>(others), std::ceil(fraction / other));
    taken += needed;
    fraction -= needed * other;
  }
  if (fraction > 0.0) take(above, values.end());
  return taken;
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

SparsePosterior SparsePosterior::From(CellValues probability) {
  SparsePosterior posterior;
  posterior.cells.resize(probability.size());
  std::iota(posterior.cells.begin(), posterior.cells.end(), 0);
  posterior.probability = std::move(probability);
  return posterior;
}

CellValues SparsePosterior::Dense(int grid_cells) const {
  CellValues dense(static_cast<std::size_t>(grid_cells), elsewhere);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    dense[static_cast<std::size_t>(cells[i])] = probability[i];
  }
  return dense;
}

Estimate Summarise(const FloorGrid& grid, std::span<const float> probability) {
  return Summarise(grid, SparsePosterior::From({probability.begin(), probability.end()}));
}

Estimate Summarise(const FloorGrid& grid, const SparsePosterior& posterior) {
  // What all cells have in common is known in closed form; the cells that are kept add what they
  // have beyond it.
  const auto everywhere = static_cast<double>(posterior.elsewhere);
  const Moments& whole = grid.moments();
  Estimate estimate;
  double total = everywhere * grid.size();
  Eigen::Vector2d first = everywhere * whole.first;
  Eigen::Matrix2d second = everywhere * whole.second;
  for (std::size_t i = 0; i < posterior.cells.size(); ++i) {
    const double more = static_cast<double>(posterior.probability[i]) - everywhere;
    const Eigen::Vector2d at =
        grid.centres()[static_cast<std::size_t>(posterior.cells[i])] - whole.origin;
    total += more;
    first += more * at;
    second += more * at * at.transpose();
  }
  const Eigen::Vector2d mean = first / total;
  estimate.mean = whole.origin + mean;
  estimate.covariance = second / total - mean * mean.transpose();
  estimate.covariance(1, 0) = estimate.covariance(0, 1);
  estimate.covariance += grid.cell_area_m2() / 12.0 * Eigen::Matrix2d::Identity();

  estimate.area_90_m2 =
      SmallestSet(posterior.probability, grid.size() - static_cast<int>(posterior.cells.size()),
                  everywhere, 0.9) *
      grid.cell_area_m2();
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
