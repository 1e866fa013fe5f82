// A probability over the free cells of a floor plan, and what it says in few numbers.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "services/rssi_localizer/floor_grid.hpp"

namespace beckon {

// Probability or log-probability per free cell of a FloorGrid.
using CellValues = std::vector<float>;

// Turns log-probabilities, known up to a constant, into probabilities that sum to one. Throws
// std::invalid_argument where a value is NaN or all are minus infinity.
void NormaliseLog(CellValues& log_probability);

// Probability on some of the free cells; all others share the rest evenly.
struct SparsePosterior {
  std::vector<int> cells;  // free cells, each once
  CellValues probability;  // of these
  float elsewhere = 0.0F;  // of each cell that is not among them

  static SparsePosterior From(CellValues probability);  // of every cell
  CellValues Dense(int grid_cells) const;
};

struct Estimate {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();        // posterior mean, m, map frame
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  // m^2; includes the extent of a cell
  double area_90_m2 = 0.0;  // smallest set of cells that holds 90 % of the probability
};

Estimate Summarise(const FloorGrid& grid, std::span<const float> probability);
Estimate Summarise(const FloorGrid& grid, const SparsePosterior& posterior);

// Per free cell the probability held by all cells that are more likely than it, in [0, 1): the cell
// lies in the smallest area that holds a fraction q of the probability exactly where this is < q.
CellValues CredibleLevels(std::span<const float> probability);

}  // namespace beckon
