// Bayes filter of one tag over the free cells: the person may have walked since the last reading,
// but not through walls.
#pragma once

#include "services/rssi_localizer/floor_grid.hpp"
#include "services/rssi_localizer/posterior.hpp"

namespace beckon {

struct MotionModel {
  double walk_m_per_sqrt_s = 0.8;  // standard deviation in x and in y after one second
  double lost_per_s = 0.01;        // chance a second that all that is known has become wrong
};

class GridTracker {
 public:
  // Starts with every cell alike. The grid has to outlive this.
  explicit GridTracker(const FloorGrid& grid, const MotionModel& motion = {});

  // Random walk for dt seconds (none for dt <= 0): diffusion over neighbouring cells, so that it
  // goes around walls. Longer than a minute counts as a minute.
  void Predict(double dt_s);
  // Multiplies with the likelihood. Throws std::invalid_argument for NaN, and is then unchanged.
  void Update(const CellValues& log_likelihood);

  const CellValues& probability() const { return probability_; }

 private:
  const FloorGrid& grid_;
  MotionModel motion_;
  CellValues probability_;
  CellValues next_;
};

}  // namespace beckon
