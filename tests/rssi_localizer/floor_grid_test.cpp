#include "services/rssi_localizer/floor_grid.hpp"

#include <gmock/gmock.h>

namespace beckon {
namespace {

FloorPlan Room(double width, double height) {
  FloorPlan plan;
  plan.max = {width, height};
  return plan;
}

TEST(FloorGrid, HoldsTheFreeCells) {
  FloorPlan plan = Room(4.0, 3.0);
  plan.obstacles = {{{0.0, 0.0}, {2.0, 0.0}, {2.0, 3.0}, {0.0, 3.0}}};
  const FloorGrid grid(plan, {.resolution_m = 0.5});
  EXPECT_EQ(grid.size(), 4 * 6);
  for (const Eigen::Vector2d& centre : grid.centres()) EXPECT_GT(centre.x(), 2.0);
}

TEST(FloorGrid, APlaceWhereSomebodyStoodIsFree) {
  FloorPlan plan = Room(4.0, 3.0);
  plan.obstacles = {{{0.0, 0.0}, {2.0, 0.0}, {2.0, 3.0}, {0.0, 3.0}}};
  const FloorGrid grid(plan, {.resolution_m = 0.5}, {{1.1, 1.1}, {1.2, 1.2}, {-9.0, 0.0}});
  EXPECT_EQ(grid.size(), 4 * 6 + 1);
  EXPECT_EQ(grid.centres()[static_cast<std::size_t>(grid.NearestCell({1.1, 1.1}))],
            Eigen::Vector2d(1.25, 1.25));
}

TEST(FloorGrid, CellsGrowUntilTheyAreFewEnough) {
  const FloorGrid grid(Room(100.0, 100.0), {.resolution_m = 0.25, .max_cells = 40000});
  EXPECT_EQ(grid.geometry().resolution_m, 0.5);
  EXPECT_EQ(grid.size(), 40000);
}

TEST(FloorGrid, NeighboursStopAtWallsAndBorders) {
  FloorPlan plan = Room(2.0, 1.0);
  plan.walls = {{{1.0, -1.0}, {1.0, 2.0}, std::nullopt}};
  const FloorGrid grid(plan, {.resolution_m = 1.0});
  for (int cell = 0; cell < grid.size(); ++cell) {
    EXPECT_THAT(grid.neighbours(cell), ::testing::Each(-1));
  }
  const FloorGrid open(Room(2.0, 1.0), {.resolution_m = 1.0});
  EXPECT_THAT(open.neighbours(0), ::testing::ElementsAre(1, -1, -1, -1));
  EXPECT_THAT(open.neighbours(1), ::testing::ElementsAre(-1, 0, -1, -1));
}

TEST(FloorGrid, NearestCellOfAPointOutside) {
  const FloorGrid grid(Room(4.0, 3.0), {.resolution_m = 1.0});
  EXPECT_EQ(grid.centres()[static_cast<std::size_t>(grid.NearestCell({9.0, -5.0}))],
            Eigen::Vector2d(3.5, 0.5));
}

TEST(FloorGrid, APlanWithoutFreeCellIsRefused) {
  FloorPlan plan = Room(4.0, 3.0);
  plan.obstacles = {{{-1.0, -1.0}, {5.0, -1.0}, {5.0, 4.0}, {-1.0, 4.0}}};
  EXPECT_THROW(FloorGrid(plan, {}), std::invalid_argument);
}

}  // namespace
}  // namespace beckon
