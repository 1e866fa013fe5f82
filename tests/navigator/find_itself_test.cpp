// A robot that is called and has no place on the map: it looks round and drives into free floor, as
// safely as ever, until its pose comes.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "services/navigator/stop_reasons.hpp"
#include "tests/navigator/test_world.hpp"

namespace beckon {
namespace {

using testing::TestWorld;

// A flat of 10 x 6 m with a wall and a doorway across, a box in each half that is not on the plan.
FloorPlan Flat() {
  FloorPlan plan;
  plan.min = {-0.5, -0.5};
  plan.max = {10.5, 6.5};
  plan.outline = {{0, 0}, {10, 0}, {10, 6}, {0, 6}};
  plan.walls = {{{5, 0}, {5, 2}, std::nullopt}, {{5, 3}, {5, 6}, std::nullopt}};
  return plan;
}
const std::vector<Polygon> kBoxes = {{{2.0, 3.5}, {3.0, 3.5}, {3.0, 4.2}, {2.0, 4.2}},
                                     {{7.0, 1.5}, {7.6, 1.5}, {7.6, 2.5}, {7.0, 2.5}}};
constexpr Pose2 kStart{1.5, 1.5, 0.7};

bool NoPose(Utime&, Pose2&) { return false; }

TEST(FindItself, LooksRoundDrivesOnAndComesOnceItKnowsWhereItIs) {
  TestWorld world(Flat(), kBoxes, kStart);
  world.tamper_pose = [&](Utime&, Pose2&) { return world.driven_m() > 6.0; };
  world.CallTo({8.5, 4.5});
  EXPECT_TRUE(world.Run(90.0, [&] { return world.driven_m() > 5.9; })) << world.status().detail;
  EXPECT_GT(world.turned_rad(), 2.0 * 3.1);
  ASSERT_TRUE(world.RunToEnd(90.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_FALSE(world.has_collided());
}

TEST(FindItself, APoseThatStaysAwayOnTheWayIsWaitedForFirst) {
  TestWorld world(Flat(), kBoxes, kStart);
  world.CallTo({8.5, 4.5});
  ASSERT_TRUE(world.Run(20.0, [&] { return world.driven_m() > 0.5; }));
  world.tamper_pose = NoPose;
  world.Run(3.5);  // two seconds until it is stale, and some to brake
  EXPECT_EQ(world.status().stop_reason, stop_reason::kPoseStale);
  const double stood_at_m = world.driven_m();
  world.Run(1.0);
  EXPECT_NEAR(world.driven_m(), stood_at_m, 1e-6);
  EXPECT_TRUE(world.Run(60.0, [&] { return world.driven_m() > stood_at_m + 1.0; }));
}

TEST(FindItself, WithoutScansItStands) {
  TestWorld world(Flat(), kBoxes, kStart);
  world.tamper_pose = NoPose;
  world.CallTo({8.5, 4.5});
  ASSERT_TRUE(world.Run(60.0, [&] { return world.driven_m() > 0.5; }));
  world.tamper_scan = [](Scan&) { return false; };
  world.Run(2.0);
  EXPECT_EQ(world.status().stop_reason, stop_reason::kScanStale);
  EXPECT_EQ(world.speed(), 0.0);
}

TEST(FindItself, NobodyCallsNobodyMoves) {
  TestWorld world(Flat(), kBoxes, kStart);
  world.tamper_pose = NoPose;
  world.Run(15.0);
  EXPECT_EQ(world.driven_m(), 0.0);
  EXPECT_EQ(world.turned_rad(), 0.0);
}

TEST(FindItself, CanBeSwitchedOff) {
  NavigatorOptions options = TestWorld::DefaultNavigator();
  options.find_itself_after_s = 0.0;
  TestWorld world(Flat(), kBoxes, kStart, {}, options);
  world.tamper_pose = NoPose;
  world.CallTo({8.5, 4.5});
  world.Run(30.0);
  EXPECT_EQ(world.turned_rad(), 0.0);
  EXPECT_EQ(world.status().stop_reason, stop_reason::kPoseMissing);
}

TEST(FindItself, IsGivenUpInTheEnd) {
  TestWorld world(Flat(), kBoxes, kStart);
  world.tamper_pose = NoPose;
  world.CallTo({8.5, 4.5});
  ASSERT_TRUE(world.RunToEnd(240.0));
  EXPECT_EQ(world.status().state, NavigatorState::kGaveUp);
  EXPECT_THAT(world.status().detail, ::testing::HasSubstr("does not find itself"));
  EXPECT_FALSE(world.has_collided());
}

}  // namespace
}  // namespace beckon
