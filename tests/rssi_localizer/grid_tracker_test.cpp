#include "services/rssi_localizer/grid_tracker.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>
#include <span>

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

void Update(const FloorGrid& grid, GridTracker& tracker, const CellValues& log_likelihood) {
  tracker.Update(
      [&](std::span<const int> cells) {
        CellValues values;
        for (const int cell : cells) {
          values.push_back(log_likelihood[static_cast<std::size_t>(cell)]);
        }
        return values;
      },
      [&] {
        CellValues values;
        for (const FloorGrid::Block& block : grid.blocks()) {
          values.push_back(log_likelihood[static_cast<std::size_t>(block.representative)]);
        }
        return values;
      });
}

// A tag on a big floor: log-likelihood of a distance to each of three points.
CellValues ThreeDistances(const FloorGrid& grid, const Eigen::Vector2d& tag) {
  CellValues log(static_cast<std::size_t>(grid.size()), 0.0F);
  for (const Eigen::Vector2d& from : {Eigen::Vector2d(0.0, 0.0), {60.0, 0.0}, {20.0, 60.0}}) {
    const double measured = (tag - from).norm();
    for (std::size_t cell = 0; cell < log.size(); ++cell) {
      const double off = ((grid.centres()[cell] - from).norm() - measured) / 2.0;
      log[cell] -= static_cast<float>(std::log1p(0.5 * off * off));
    }
  }
  return log;
}

TEST(GridTracker, OnABigFloorItKeepsFewCellsAndIsAsGoodAsWithAll) {
  FloorPlan plan;
  plan.max = {60.0, 60.0};
  plan.walls = {{{30.0, 0.0}, {30.0, 40.0}, std::nullopt}};
  const FloorGrid grid(plan, {.resolution_m = 0.5});
  GridTracker tracker(grid);
  // The same filter with every cell kept: diffusion written out, then Bayes.
  CellValues reference(static_cast<std::size_t>(grid.size()),
                       1.0F / static_cast<float>(grid.size()));
  for (int second = 0; second < 12; ++second) {
    const Eigen::Vector2d tag(22.0 + second, 45.0);
    const CellValues log = ThreeDistances(grid, tag);
    if (second > 0) tracker.Predict(1.0);
    Update(grid, tracker, log);

    constexpr int kPasses = 7;
    const double share = 0.64 / (2.0 * kPasses * 0.25);
    for (int pass = 0; second > 0 && pass < kPasses; ++pass) {
      CellValues next = reference;
      for (std::size_t cell = 0; cell < next.size(); ++cell) {
        for (const int to : grid.neighbours(static_cast<int>(cell))) {
          if (to < 0) continue;
          next[cell] += static_cast<float>(share) *
                        (reference[static_cast<std::size_t>(to)] - reference[cell]);
        }
      }
      reference = next;
    }
    for (std::size_t cell = 0; cell < reference.size(); ++cell) {
      const float mixed = second == 0
                              ? reference[cell]
                              : 0.99F * reference[cell] + 0.01F / static_cast<float>(grid.size());
      reference[cell] = std::log(mixed) + log[cell];
    }
    NormaliseLog(reference);

    const Estimate sparse = Summarise(grid, tracker.posterior());
    const Estimate dense = Summarise(grid, reference);
    EXPECT_LT((sparse.mean - dense.mean).norm(), 0.05) << second;
    EXPECT_NEAR(sparse.covariance.trace() / dense.covariance.trace(), 1.0, 0.1) << second;
    EXPECT_NEAR(sparse.area_90_m2 / dense.area_90_m2, 1.0, 0.05) << second;
  }
  EXPECT_LT(tracker.posterior().cells.size(), static_cast<std::size_t>(grid.size() / 4));
}

TEST(GridTracker, ARandomWalkSpreadsByItsVariance) {
  const FloorGrid grid = Room();
  GridTracker tracker(grid, {.walk_m_per_sqrt_s = 0.5, .lost_per_s = 0.0});
  Update(grid, tracker, Certain(grid, {5.1, 5.1}));
  for (int i = 0; i < 8; ++i) tracker.Predict(0.25);
  const Estimate estimate = Summarise(grid, tracker.posterior());
  const double cell = 0.25 * 0.25 / 12.0;
  EXPECT_NEAR(estimate.covariance(0, 0), 0.25 * 2.0 + cell, 1e-3);
  EXPECT_NEAR(estimate.covariance(1, 1), 0.25 * 2.0 + cell, 1e-3);
  EXPECT_NEAR(estimate.covariance(0, 1), 0.0, 1e-4);
  const CellValues probability = tracker.posterior().Dense(grid.size());
  EXPECT_NEAR(std::accumulate(probability.begin(), probability.end(), 0.0), 1.0, 1e-4);
}

TEST(GridTracker, DoesNotWalkThroughWalls) {
  const FloorGrid grid = Room({{{5.0, 0.0}, {5.0, 10.0}, std::nullopt}});
  GridTracker tracker(grid, {.walk_m_per_sqrt_s = 1.0, .lost_per_s = 0.0});
  Update(grid, tracker, Certain(grid, {4.6, 5.0}));
  for (int i = 0; i < 30; ++i) tracker.Predict(1.0);
  double beyond = 0.0;
  const CellValues probability = tracker.posterior().Dense(grid.size());
  for (std::size_t cell = 0; cell < probability.size(); ++cell) {
    if (grid.centres()[cell].x() > 5.0) beyond += static_cast<double>(probability[cell]);
  }
  EXPECT_LT(beyond, 1e-5) << "blocks with next to nothing share it with the rest of the floor";
}

TEST(GridTracker, WalksThroughADoor) {
  const FloorGrid grid =
      Room({{{5.0, 0.0}, {5.0, 4.5}, std::nullopt}, {{5.0, 5.5}, {5.0, 10.0}, std::nullopt}});
  GridTracker tracker(grid, {.walk_m_per_sqrt_s = 1.0, .lost_per_s = 0.0});
  Update(grid, tracker, Certain(grid, {4.6, 5.0}));
  tracker.Predict(4.0);
  double beyond = 0.0;
  const CellValues probability = tracker.posterior().Dense(grid.size());
  for (std::size_t cell = 0; cell < probability.size(); ++cell) {
    if (grid.centres()[cell].x() > 5.0) beyond += static_cast<double>(probability[cell]);
  }
  EXPECT_GT(beyond, 0.05);
  EXPECT_LT(beyond, 0.5);
}

TEST(GridTracker, RecoversFromACertaintyThatWasWrong) {
  const FloorGrid grid = Room();
  GridTracker tracker(grid, {});
  Update(grid, tracker, Certain(grid, {1.0, 1.0}));
  for (int second = 0; second < 3; ++second) {
    tracker.Predict(1.0);
    CellValues log;
    for (const Eigen::Vector2d& centre : grid.centres()) {
      log.push_back(static_cast<float>(-0.5 * (centre - Eigen::Vector2d(8.0, 8.0)).squaredNorm()));
    }
    Update(grid, tracker, log);
  }
  EXPECT_LT((Summarise(grid, tracker.posterior()).mean - Eigen::Vector2d(8.0, 8.0)).norm(), 0.5);
}

TEST(GridTracker, TimeThatDoesNotPassChangesNothing) {
  const FloorGrid grid = Room();
  GridTracker tracker(grid);
  Update(grid, tracker, Certain(grid, {1.0, 1.0}));
  const CellValues before = tracker.posterior().Dense(grid.size());
  tracker.Predict(0.0);
  tracker.Predict(-5.0);
  tracker.Predict(std::nan(""));
  EXPECT_EQ(tracker.posterior().Dense(grid.size()), before);
}

TEST(GridTracker, NonsenseIsRefusedAndLeavesItUnchanged) {
  const FloorGrid grid = Room();
  GridTracker tracker(grid);
  Update(grid, tracker, Certain(grid, {1.0, 1.0}));
  const CellValues before = tracker.posterior().Dense(grid.size());
  EXPECT_THROW(Update(grid, tracker, CellValues(before.size(), std::nanf(""))),
               std::invalid_argument);
  EXPECT_EQ(tracker.posterior().Dense(grid.size()), before);
}

}  // namespace
}  // namespace beckon
