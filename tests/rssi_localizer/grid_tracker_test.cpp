#include "services/rssi_localizer/grid_tracker.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>

namespace beckon {
namespace {

FloorGrid Room(const std::vector<Wall>& walls = {}) {
  FloorPlan plan;
  plan.max = {10.0, 10.0};
  plan.walls = walls;
  return FloorGrid(plan, {.resolution_m = 0.25});
}

// Certain to be at a place.
CellValues Certain(const FloorGrid& grid, const Eigen::Vector2d& place) {
  CellValues log(static_cast<std::size_t>(grid.size()), -60.0F);
  log[static_cast<std::size_t>(grid.NearestCell(place))] = 0.0F;
  return log;
}

TEST(GridTracker, ARandomWalkSpreadsByItsVariance) {
  const FloorGrid grid = Room();
  GridTracker tracker(grid, {.walk_m_per_sqrt_s = 0.5, .lost_per_s = 0.0});
  tracker.Update(Certain(grid, {5.1, 5.1}));
  for (int i = 0; i < 8; ++i) tracker.Predict(0.25);
  const Estimate estimate = Summarise(grid, tracker.probability());
  const double cell = 0.25 * 0.25 / 12.0;
  EXPECT_NEAR(estimate.covariance(0, 0), 0.25 * 2.0 + cell, 1e-3);
  EXPECT_NEAR(estimate.covariance(1, 1), 0.25 * 2.0 + cell, 1e-3);
  EXPECT_NEAR(estimate.covariance(0, 1), 0.0, 1e-4);
  EXPECT_NEAR(std::accumulate(tracker.probability().begin(), tracker.probability().end(), 0.0), 1.0,
              1e-4);
}

TEST(GridTracker, DoesNotWalkThroughWalls) {
  const FloorGrid grid = Room({{{5.0, 0.0}, {5.0, 10.0}, std::nullopt}});
  GridTracker tracker(grid, {.walk_m_per_sqrt_s = 1.0, .lost_per_s = 0.0});
  tracker.Update(Certain(grid, {4.6, 5.0}));
  for (int i = 0; i < 30; ++i) tracker.Predict(1.0);
  double beyond = 0.0;
  for (std::size_t cell = 0; cell < tracker.probability().size(); ++cell) {
    if (grid.centres()[cell].x() > 5.0) beyond += static_cast<double>(tracker.probability()[cell]);
  }
  EXPECT_LT(beyond, 1e-12);
}

TEST(GridTracker, WalksThroughADoor) {
  const FloorGrid grid =
      Room({{{5.0, 0.0}, {5.0, 4.5}, std::nullopt}, {{5.0, 5.5}, {5.0, 10.0}, std::nullopt}});
  GridTracker tracker(grid, {.walk_m_per_sqrt_s = 1.0, .lost_per_s = 0.0});
  tracker.Update(Certain(grid, {4.6, 5.0}));
  tracker.Predict(4.0);
  double beyond = 0.0;
  for (std::size_t cell = 0; cell < tracker.probability().size(); ++cell) {
    if (grid.centres()[cell].x() > 5.0) beyond += static_cast<double>(tracker.probability()[cell]);
  }
  EXPECT_GT(beyond, 0.05);
  EXPECT_LT(beyond, 0.5);
}

TEST(GridTracker, RecoversFromACertaintyThatWasWrong) {
  const FloorGrid grid = Room();
  GridTracker tracker(grid, {});
  tracker.Update(Certain(grid, {1.0, 1.0}));
  for (int second = 0; second < 3; ++second) {
    tracker.Predict(1.0);
    CellValues log;
    for (const Eigen::Vector2d& centre : grid.centres()) {
      log.push_back(static_cast<float>(-0.5 * (centre - Eigen::Vector2d(8.0, 8.0)).squaredNorm()));
    }
    tracker.Update(log);
  }
  EXPECT_LT((Summarise(grid, tracker.probability()).mean - Eigen::Vector2d(8.0, 8.0)).norm(), 0.5);
}

TEST(GridTracker, TimeThatDoesNotPassChangesNothing) {
  const FloorGrid grid = Room();
  GridTracker tracker(grid);
  tracker.Update(Certain(grid, {1.0, 1.0}));
  const CellValues before = tracker.probability();
  tracker.Predict(0.0);
  tracker.Predict(-5.0);
  tracker.Predict(std::nan(""));
  EXPECT_EQ(tracker.probability(), before);
}

TEST(GridTracker, NonsenseIsRefusedAndLeavesItUnchanged) {
  const FloorGrid grid = Room();
  GridTracker tracker(grid);
  tracker.Update(Certain(grid, {1.0, 1.0}));
  const CellValues before = tracker.probability();
  EXPECT_THROW(tracker.Update(CellValues(before.size(), std::nanf(""))), std::invalid_argument);
  EXPECT_EQ(tracker.probability(), before);
}

}  // namespace
}  // namespace beckon
