// Bayes filter of one tag over the free cells: the person may have walked since the last reading,
// but not through walls.
//
// It keeps the probability only in the blocks of cells where there is any to speak of. A building
// has tens of thousands of cells and a tag may be in some hundreds, so a thousand tags cost what
// the few cells of each cost.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "services/rssi_localizer/floor_grid.hpp"
#include "services/rssi_localizer/posterior.hpp"

namespace beckon {

struct MotionModel {
  double walk_m_per_sqrt_s = 0.8;  // standard deviation in x and in y after one second
  double lost_per_s = 0.01;        // chance a second that all that is known has become wrong
};

class GridTracker {
 public:
  // Log-likelihood of each of some free cells, up to a constant that is the same for all calls.
  using LogLikelihoodOf = std::function<CellValues(std::span<const int> cells)>;
  // The same for the representative of every block of the grid, in their order.
  using LogLikelihoodOfBlocks = std::function<CellValues()>;

  // Starts with every cell alike. The grid has to outlive this.
  explicit GridTracker(const FloorGrid& grid, const MotionModel& motion = {});

  // Random walk for dt seconds (none for dt <= 0): diffusion over neighbouring cells, so that it
  // goes around walls. Longer than a minute counts as a minute.
  void Predict(double dt_s);
  // Multiplies with the likelihood, which is asked for in the cells that are kept, in one cell of
  // each block, and in all cells of the blocks that this brings back. Throws
  // std::invalid_argument for NaN, and is then unchanged.
  void Update(const LogLikelihoodOf& log_likelihood, const LogLikelihoodOfBlocks& of_blocks);

  const SparsePosterior& posterior() const { return posterior_; }

 private:
  void AddBlock(int block, CellValues& values, float value);
  void AddBlocksWithin(double reach_m);
  void Diffuse(int passes, float share);
  void DropNegligibleBlocks();
  std::vector<char> Kept() const;  // per block of the grid

  const FloorGrid& grid_;
  MotionModel motion_;
  SparsePosterior posterior_;
  std::vector<int> blocks_;  // whose cells the posterior holds, one after the other
};

}  // namespace beckon
