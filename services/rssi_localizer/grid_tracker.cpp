#include "services/rssi_localizer/grid_tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace beckon {
namespace {

// A block with less is not kept: all such blocks of the largest grid together hold a hundredth.
constexpr double kNegligible = 4e-6;

double LogOf(float probability) {
  return std::log(std::max(static_cast<double>(probability), 1e-30));
}

}  // namespace

GridTracker::GridTracker(const FloorGrid& grid, const MotionModel& motion)
    : grid_(grid), motion_(motion) {
  posterior_.elsewhere = 1.0F / static_cast<float>(grid.size());
}

std::vector<char> GridTracker::Kept() const {
  std::vector<char> kept(grid_.blocks().size(), 0);
  for (const int block : blocks_) kept[static_cast<std::size_t>(block)] = 1;
  return kept;
}

void GridTracker::AddBlock(int block, CellValues& values, float value) {
  const std::vector<int>& cells = grid_.blocks()[static_cast<std::size_t>(block)].cells;
  blocks_.push_back(block);
  posterior_.cells.insert(posterior_.cells.end(), cells.begin(), cells.end());
  values.insert(values.end(), cells.size(), value);
}

void GridTracker::AddBlocksWithin(double reach_m) {
  const double side_m = FloorGrid::kBlockSide * grid_.geometry().resolution_m;
  std::vector<char> kept = Kept();
  std::size_t frontier = 0;
  for (double reached_m = 0.0; reached_m < reach_m; reached_m += side_m) {
    const std::size_t end = blocks_.size();
    for (; frontier < end; ++frontier) {
      const auto block = static_cast<std::size_t>(blocks_[frontier]);
      for (const int neighbour : grid_.blocks()[block].neighbours) {
        if (kept[static_cast<std::size_t>(neighbour)] != 0) continue;
        kept[static_cast<std::size_t>(neighbour)] = 1;
        AddBlock(neighbour, posterior_.probability, posterior_.elsewhere);
      }
    }
  }
}

void GridTracker::Diffuse(int passes, float share) {
  // Where in the posterior each neighbour of each cell stands; nothing leaves the kept blocks.
  std::vector<int> first_of(grid_.blocks().size(), -1);
  int first = 0;
  for (const int block : blocks_) {
    first_of[static_cast<std::size_t>(block)] = first;
    first += static_cast<int>(grid_.blocks()[static_cast<std::size_t>(block)].cells.size());
  }
  std::vector<std::array<int, 4>> neighbours(posterior_.cells.size());
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    const std::array<int, 4>& cells = grid_.neighbours(posterior_.cells[i]);
    for (std::size_t k = 0; k < cells.size(); ++k) {
      // A cell is its own neighbour where there is none: then nothing flows.
      neighbours[i][k] = static_cast<int>(i);
      if (cells[k] < 0) continue;
      const int block = first_of[static_cast<std::size_t>(grid_.block_of(cells[k]))];
      if (block >= 0) neighbours[i][k] = block + grid_.place_in_block(cells[k]);
    }
  }
  CellValues& probability = posterior_.probability;
  CellValues next(probability.size());
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t i = 0; i < probability.size(); ++i) {
      float inflow = 0.0F;
      for (const int neighbour : neighbours[i]) {
        inflow += probability[static_cast<std::size_t>(neighbour)];
      }
      next[i] = probability[i] + share * (inflow - 4.0F * probability[i]);
    }
    std::swap(probability, next);
  }
}

void GridTracker::DropNegligibleBlocks() {
  double rest_cells = static_cast<double>(grid_.size() - static_cast<int>(posterior_.cells.size()));
  double rest = static_cast<double>(posterior_.elsewhere) * rest_cells;
  std::vector<int> blocks;
  std::size_t from = 0;
  std::size_t to = 0;
  for (const int block : blocks_) {
    const std::size_t size = grid_.blocks()[static_cast<std::size_t>(block)].cells.size();
    double held = 0.0;
    for (std::size_t i = from; i < from + size; ++i) {
      held += static_cast<double>(posterior_.probability[i]);
    }
    if (held < kNegligible) {
      rest += held;
      rest_cells += static_cast<double>(size);
    } else {
      blocks.push_back(block);
      for (std::size_t i = from; i < from + size; ++i, ++to) {
        posterior_.probability[to] = posterior_.probability[i];
        posterior_.cells[to] = posterior_.cells[i];
      }
    }
    from += size;
  }
  posterior_.probability.resize(to);
  posterior_.cells.resize(to);
  posterior_.elsewhere = rest_cells > 0.0 ? static_cast<float>(rest / rest_cells) : 0.0F;
  blocks_ = std::move(blocks);
}

void GridTracker::Predict(double dt_s) {
  constexpr double kLongestS = 60.0;
  constexpr double kReachSds = 3.5;
  if (!(dt_s > 0.0)) return;
  const double dt = std::min(dt_s, kLongestS);
  // One pass moves a share to each neighbour and so adds 2 share cell^2 to the variance in x and in
  // y. Up to a fifth the result stays close to a Gaussian.
  constexpr double kLargestShare = 0.2;
  const double cell = grid_.geometry().resolution_m;
  const double variance = motion_.walk_m_per_sqrt_s * motion_.walk_m_per_sqrt_s * dt;
  const int passes =
      std::max(1, static_cast<int>(std::ceil(variance / (2.0 * kLargestShare * cell * cell))));
  AddBlocksWithin(kReachSds * std::sqrt(variance));
  Diffuse(passes, static_cast<float>(variance / (2.0 * passes * cell * cell)));
  const auto lost = static_cast<float>(1.0 - std::pow(1.0 - motion_.lost_per_s, dt));
  const float anywhere = lost / static_cast<float>(grid_.size());
  for (float& value : posterior_.probability) value = (1.0F - lost) * value + anywhere;
  posterior_.elsewhere = (1.0F - lost) * posterior_.elsewhere + anywhere;
  DropNegligibleBlocks();
}

void GridTracker::Update(const LogLikelihoodOf& log_likelihood,
                         const LogLikelihoodOfBlocks& of_blocks) {
  const std::vector<char> kept = Kept();
  std::vector<int> others;  // blocks
  CellValues there;         // at their representatives
  const CellValues blocks = of_blocks();
  for (std::size_t block = 0; block < kept.size(); ++block) {
    if (kept[block] != 0) continue;
    others.push_back(static_cast<int>(block));
    there.push_back(blocks[block]);
  }
  CellValues here = log_likelihood(posterior_.cells);
  const double log_elsewhere = LogOf(posterior_.elsewhere);
  double greatest = -std::numeric_limits<double>::infinity();
  const auto add_prior = [&](float& value, double log_prior) {
    value += static_cast<float>(log_prior);
    if (std::isnan(value)) throw std::invalid_argument("a log-likelihood is not a number");
    greatest = std::max(greatest, static_cast<double>(value));
  };
  for (std::size_t i = 0; i < here.size(); ++i)
    add_prior(here[i], LogOf(posterior_.probability[i]));
  for (float& value : there) add_prior(value, log_elsewhere);
  if (std::isinf(greatest)) throw std::invalid_argument("no cell has a probability above zero");

  const auto held_by_other = [&](std::size_t i) {
    const auto block = static_cast<std::size_t>(others[i]);
    return static_cast<double>(grid_.blocks()[block].cells.size()) *
           std::exp(static_cast<double>(there[i]) - greatest);
  };
  double total = 0.0;
  for (const float value : here) total += std::exp(static_cast<double>(value) - greatest);
  for (std::size_t i = 0; i < others.size(); ++i) total += held_by_other(i);

  const std::size_t known = here.size();
  double rest = 0.0;
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (held_by_other(i) < kNegligible * total) {
      rest += held_by_other(i);
    } else {
      AddBlock(others[i], here, 0.0F);
    }
  }
  const std::span<const int> woken(posterior_.cells.begin() + static_cast<std::ptrdiff_t>(known),
                                   posterior_.cells.end());
  const CellValues of_woken = log_likelihood(woken);
  for (std::size_t i = 0; i < of_woken.size(); ++i) {
    here[known + i] = of_woken[i] + static_cast<float>(log_elsewhere);
  }

  total = rest;
  for (float& value : here) {
    value = static_cast<float>(std::exp(static_cast<double>(value) - greatest));
    total += static_cast<double>(value);
  }
  for (float& value : here) value = static_cast<float>(static_cast<double>(value) / total);
  posterior_.probability = std::move(here);
  const double rest_cells =
      static_cast<double>(grid_.size() - static_cast<int>(posterior_.cells.size()));
  posterior_.elsewhere = rest_cells > 0.0 ? static_cast<float>(rest / rest_cells / total) : 0.0F;
  DropNegligibleBlocks();
}

}  // namespace beckon
