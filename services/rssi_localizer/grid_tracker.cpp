#include "services/rssi_localizer/grid_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {

GridTracker::GridTracker(const FloorGrid& grid, const MotionModel& motion)
    : grid_(grid),
      motion_(motion),
      probability_(static_cast<std::size_t>(grid.size()), 1.0F / static_cast<float>(grid.size())),
      next_(probability_.size()) {}

void GridTracker::Predict(double dt_s) {
  constexpr double kLongestS = 60.0;
  if (!(dt_s > 0.0)) return;
  const double dt = std::min(dt_s, kLongestS);
  // One pass moves a share to each neighbour and so adds 2 share cell^2 to the variance in x and in
  // y. Up to a fifth the result stays close to a Gaussian.
  constexpr double kLargestShare = 0.2;
  const double cell = grid_.geometry().resolution_m;
  const double variance = motion_.walk_m_per_sqrt_s * motion_.walk_m_per_sqrt_s * dt;
  const int passes =
      std::max(1, static_cast<int>(std::ceil(variance / (2.0 * kLargestShare * cell * cell))));
  const auto share = static_cast<float>(variance / (2.0 * passes * cell * cell));
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t i = 0; i < probability_.size(); ++i) {
      const float here = probability_[i];
      float inflow = 0.0F;
      for (const int neighbour : grid_.neighbours(static_cast<int>(i))) {
        if (neighbour >= 0) inflow += probability_[static_cast<std::size_t>(neighbour)] - here;
      }
      next_[i] = here + share * inflow;
    }
    std::swap(probability_, next_);
  }
  const auto lost = static_cast<float>(1.0 - std::pow(1.0 - motion_.lost_per_s, dt));
  const float anywhere = lost / static_cast<float>(grid_.size());
  for (float& value : probability_) value = (1.0F - lost) * value + anywhere;
}

void GridTracker::Update(const CellValues& log_likelihood) {
  for (std::size_t i = 0; i < next_.size(); ++i) {
    next_[i] = std::log(std::max(probability_[i], 1e-30F)) + log_likelihood[i];
  }
  NormaliseLog(next_);
  std::swap(probability_, next_);
}

}  // namespace beckon
