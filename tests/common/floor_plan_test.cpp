#include "common/floor_plan.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

namespace beckon {
namespace {

constexpr double kPi = std::numbers::pi;

// An L-shaped room of 4 x 4 m without its upper right quarter, a pillar, and a thin wall.
FloorPlan TestPlan() {
  FloorPlan plan;
  plan.min = {0.0, 0.0};
  plan.max = {4.0, 4.0};
  plan.outline = {{0.0, 0.0}, {4.0, 0.0}, {4.0, 2.0}, {2.0, 2.0}, {2.0, 4.0}, {0.0, 4.0}};
  plan.obstacles = {{{1.0, 0.5}, {1.5, 0.5}, {1.5, 1.0}, {1.0, 1.0}}};
  plan.walls = {{{0.0, 3.0}, {1.0, 3.0}, 5.0}};
  return plan;
}

TEST(FloorPlan, FreePlaces) {
  const FloorPlan plan = TestPlan();
  EXPECT_TRUE(plan.IsFree({0.5, 0.5}));
  EXPECT_FALSE(plan.IsFree({3.0, 3.0})) << "outside the outline";
  EXPECT_FALSE(plan.IsFree({1.2, 0.7})) << "in the pillar";
  EXPECT_FALSE(plan.IsFree({-0.1, 1.0})) << "outside the area";
}

TEST(FloorPlan, MaskHasTheWallsInIt) {
  const FloorPlan plan = TestPlan();
  const auto grid = GridGeometry::Covering(plan.min, plan.max, 0.1);
  const cv::Mat mask = plan.FreeMask(grid);
  int free_cells = cv::countNonZero(mask);
  // 12 m^2 of L less 0.25 m^2 of pillar, less the row of cells that the wall of 1 m runs through.
  EXPECT_NEAR(free_cells, 1200 - 25 - 11, 2);
  EXPECT_EQ(mask.at<std::uint8_t>(grid.Row(3.0), grid.Column(0.55)), 0);
}

TEST(FloorPlan, RaysMeetTheNearestFace) {
  const FloorPlan plan = TestPlan();
  EXPECT_NEAR(plan.CastRay({0.5, 0.75}, 0.0, 10.0), 0.5, 1e-9) << "pillar";
  EXPECT_NEAR(plan.CastRay({0.5, 1.5}, 0.0, 10.0), 3.5, 1e-9) << "outline";
  EXPECT_NEAR(plan.CastRay({0.5, 1.5}, kPi / 2.0, 10.0), 1.5, 1e-9) << "thin wall";
  EXPECT_NEAR(plan.CastRay({3.0, 1.0}, 3.0 * kPi / 4.0, 10.0), std::sqrt(2.0), 1e-9)
      << "corner of the L";
  EXPECT_TRUE(std::isinf(plan.CastRay({0.5, 1.5}, 0.0, 3.4))) << "beyond the maximum range";
}

TEST(FloorPlan, RaysMeetTheMapImage) {
  FloorPlan plan;
  plan.min = {0.0, 0.0};
  plan.max = {2.0, 2.0};
  MapImage image;
  image.grid = GridGeometry::Covering(plan.min, plan.max, 0.1);
  image.free = cv::Mat(20, 20, CV_8UC1, cv::Scalar(255));
  image.free.col(15).setTo(0);
  plan.image = image;
  EXPECT_NEAR(plan.CastRay({0.5, 0.5}, 0.0, 5.0), 1.0, 0.06);
  EXPECT_FALSE(plan.IsFree({1.55, 0.5}));
}

TEST(SegmentsMeet, AllWays) {
  EXPECT_TRUE(SegmentsMeet({0, 0}, {2, 2}, {0, 2}, {2, 0}));
  EXPECT_FALSE(SegmentsMeet({0, 0}, {1, 1}, {2, 0}, {2, 5}));
  EXPECT_TRUE(SegmentsMeet({0, 0}, {2, 0}, {1, 0}, {1, 5})) << "end on the other";
  EXPECT_TRUE(SegmentsMeet({0, 0}, {2, 0}, {1, 0}, {3, 0})) << "overlap";
  EXPECT_FALSE(SegmentsMeet({0, 0}, {1, 0}, {2, 0}, {3, 0})) << "on one line, apart";
}

}  // namespace
}  // namespace beckon
