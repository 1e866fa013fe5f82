// The navigator in a world that moves with it. What is promised is checked on the world's truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/navigator/stop_reasons.hpp"
#include "tests/navigator/test_world.hpp"

namespace beckon {
namespace {

using testing::Person;
using testing::TestWorld;
using testing::TestWorldOptions;

Polygon Box(double x, double y, double width, double depth) {
  return {{x - width / 2, y - depth / 2},
          {x + width / 2, y - depth / 2},
          {x + width / 2, y + depth / 2},
          {x - width / 2, y + depth / 2}};
}

// A hall of 10 x 6 m, from (0, 0), with a wall all round.
FloorPlan Hall() {
  FloorPlan plan;
  plan.min = {-0.5, -0.5};
  plan.max = {10.5, 6.5};
  plan.outline = {{0, 0}, {10, 0}, {10, 6}, {0, 6}};
  return plan;
}

// The same with a wall across at x = 5 and a door in it.
FloorPlan TwoRooms(double door_y, double door_width) {
  FloorPlan plan = Hall();
  plan.walls.push_back({{5, 0}, {5, door_y - door_width / 2}, std::nullopt});
  plan.walls.push_back({{5, door_y + door_width / 2}, {5, 6}, std::nullopt});
  return plan;
}

TEST(ClosedLoop, DrivesStraightToAPoint) {
  TestWorld world(Hall(), {}, {1.0, 3.0, 0.0});
  world.CallTo({8.0, 3.0});
  // Before it sets off, it looks at the floor to its left and right.
  ASSERT_TRUE(world.Run(15.0, [&] { return world.driven_m() > 0.5; }));
  const double looked_rad = world.turned_rad();
  EXPECT_GT(looked_rad, 2.0);
  EXPECT_LT(looked_rad, 5.5);
  ASSERT_TRUE(world.RunToEnd(40.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived);
  EXPECT_LT((world.position() - Eigen::Vector2d(8.0, 3.0)).norm(), 0.2);
  EXPECT_LT(world.driven_m(), 7.2);
  EXPECT_LT(world.elapsed_s(), 25.0);  // 14 s at full speed
  EXPECT_LT(world.turned_rad() - looked_rad, 0.4);
}

TEST(ClosedLoop, TurnsRoundFirstWhenTheGoalIsBehind) {
  TestWorld world(Hall(), {}, {5.0, 3.0, 0.0});
  world.CallTo({1.5, 3.0});
  ASSERT_TRUE(world.RunToEnd(40.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived);
  EXPECT_LT(world.driven_m(), 4.0);
  EXPECT_FALSE(world.has_collided());
}

TEST(ClosedLoop, GoesRoundABoxThatIsNotOnThePlan) {
  TestWorld world(Hall(), {Box(4.5, 3.0, 1.0, 1.4)}, {1.0, 3.0, 0.0});
  world.CallTo({8.0, 3.0});
  ASSERT_TRUE(world.RunToEnd(60.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_GT(world.closest_m(), 0.05);
  EXPECT_LT(world.driven_m(), 1.25 * 7.5);
}

TEST(ClosedLoop, LooksBeforeItTurnsIntoWhatItHasNotSeen) {
  // Right beside the robot, out of the camera's sight, stands a box on the way to the goal.
  TestWorld world(Hall(), {Box(3.0, 4.2, 1.2, 0.6)}, {3.0, 3.0, 0.0});
  world.CallTo({3.0, 5.5});
  ASSERT_TRUE(world.RunToEnd(60.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_GT(world.closest_m(), 0.02);
}

TEST(ClosedLoop, CallsOfAnotherTimeAreRefusedAndACancelNeverIs) {
  TestWorld world(Hall(), {}, {1.0, 3.0, 0.0});
  world.Run(1.0);
  const auto call_at = [&](Call::Kind kind, double age_s) {
    world.navigator().OnCall(world.now(), {kind, world.now().utime - UtimeFromSeconds(age_s), "",
                                           Eigen::Vector2d(8.0, 3.0)});
  };
  EXPECT_THROW(call_at(Call::Kind::kPoint, 10.5), std::invalid_argument);
  world.Run(1.0);
  EXPECT_EQ(world.status().state, NavigatorState::kIdle);
  EXPECT_NE(world.status().detail.find("10.5 s ago"), std::string::npos) << world.status().detail;
  EXPECT_THROW(call_at(Call::Kind::kPoint, -1.5), std::invalid_argument);
  EXPECT_NE(world.status().detail.find("1.5 s from now"), std::string::npos)
      << world.status().detail;
  call_at(Call::Kind::kPoint, 9.5);
  ASSERT_TRUE(world.Run(20.0, [&] { return world.driven_m() > 0.5; }));
  EXPECT_THROW(call_at(Call::Kind::kPoint, 3600.0), std::invalid_argument);
  EXPECT_EQ(world.status().state, NavigatorState::kDriving) << "the good one still holds";
  call_at(Call::Kind::kCancel, 3600.0);
  EXPECT_EQ(world.status().state, NavigatorState::kIdle);
  // A restarted navigator goes on with what it had accepted, however long that took so far.
  world.navigator().Resume(world.now(), {Call::Kind::kPoint, 0, "", {8.0, 3.0}});
  EXPECT_EQ(world.status().state, NavigatorState::kDriving);
}

class Door : public ::testing::TestWithParam<int> {};

TEST_P(Door, OfEightyCentimetresIsPassedBothWays) {
  TestWorldOptions options;
  options.seed = static_cast<std::uint64_t>(GetParam());
  options.faults.range_noise = 0.02;
  options.pose_noise_m = 0.02;
  options.pose_noise_rad = 0.01;
  // The localizer is off by up to 15 cm, in another direction each time.
  const double direction = 1.3 * GetParam();
  options.pose_bias = {0.15 * std::cos(direction), 0.15 * std::sin(direction), 0.02};
  TestWorld world(TwoRooms(2.2, 0.8), {}, {2.0, 4.0, 0.3 * GetParam()}, options);
  world.CallTo({8.0, 4.0});
  ASSERT_TRUE(world.RunToEnd(90.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  world.CallTo({2.0, 4.0});
  ASSERT_TRUE(world.RunToEnd(90.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_FALSE(world.has_collided()) << world.closest_m();
}

INSTANTIATE_TEST_SUITE_P(Seeds, Door, ::testing::Range(1, 6));

class NoisyWorld : public ::testing::TestWithParam<int> {};

TEST_P(NoisyWorld, PhantomsAndBlindSpotsDoNotKeepItFromArriving) {
  TestWorldOptions options;
  options.seed = static_cast<std::uint64_t>(GetParam());
  options.faults.range_noise = 0.04;
  options.faults.phantom_rate = 0.1;
  options.faults.blind_rate = 0.2;
  options.pose_noise_m = 0.03;
  options.pose_noise_rad = 0.015;
  options.odometry_drift_rad_per_m = 0.02;
  TestWorld world(TwoRooms(3.0, 0.9), {Box(3.0, 2.6, 0.6, 0.6), Box(7.2, 3.6, 0.8, 0.5)},
                  {1.0, 1.0, 1.0}, options);
  world.PutTag("caller", {9.0, 5.0});
  world.CallByTag("caller");
  ASSERT_TRUE(world.RunToEnd(120.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_LT((world.position() - Eigen::Vector2d(9.0, 5.0)).norm(), 1.8);
  EXPECT_FALSE(world.has_collided()) << world.closest_m();
}

INSTANTIATE_TEST_SUITE_P(Seeds, NoisyWorld, ::testing::Range(1, 5));

class StepsIn : public ::testing::TestWithParam<int> {};

TEST_P(StepsIn, StopsBeforeAPersonWhoStepsInAndGoesOnAfterwards) {
  TestWorldOptions options;
  options.seed = static_cast<std::uint64_t>(GetParam());
  options.faults.range_noise = 0.03;
  TestWorld world(Hall(), {}, {1.0, 3.0, 0.0}, options);
  world.CallTo({9.0, 3.0});
  ASSERT_TRUE(world.Run(20.0, [&] { return world.position().x() > 3.0; }));
  EXPECT_GT(world.speed(), 0.45);
  // From the side to the middle of the way, 1.5 m ahead, at walking pace.
  const double side = GetParam() % 2 == 0 ? 1.0 : -1.0;
  const double ahead = world.position().x() + 1.5;
  world.people.push_back({{ahead, 3.0 + 0.7 * side}, {0.0, -1.2 * side}, 0.2});
  world.Run(0.6);
  world.people[0].velocity.setZero();
  world.Run(3.0);
  EXPECT_FALSE(world.has_collided()) << world.closest_m();
  world.people.clear();
  ASSERT_TRUE(world.RunToEnd(60.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
}

INSTANTIATE_TEST_SUITE_P(Seeds, StepsIn, ::testing::Range(1, 9));

// From the side, mostly out of its view.
class StepsUp : public ::testing::TestWithParam<int> {};

TEST_P(StepsUp, NobodyWhoCameBesideTheStandingRobotIsTouched) {
  constexpr double kGapM = 0.06;
  TestWorld world(Hall(), {}, {1.0, 3.0, 0.0});
  world.CallTo({9.0, 3.0});
  ASSERT_TRUE(world.Run(30.0, [&] { return world.position().x() > 4.0; }));
  world.navigator().OnCall(world.now(), Call{});
  world.Run(1.5, [&] { return world.speed() == 0.0; });
  const double bearing = world.base().theta + RadiansFromDegrees(GetParam());
  Person person;
  const double away_m = TestWorld::DefaultNavigator().robot.radius_m + kGapM + person.radius_m;
  person.position =
      world.position() + away_m * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
  world.people.push_back(person);
  world.Run(1.5);
  world.CallTo({9.0, 3.0});
  ASSERT_TRUE(world.RunToEnd(90.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_FALSE(world.has_collided()) << world.closest_m();
}

INSTANTIATE_TEST_SUITE_P(Bearings, StepsUp, ::testing::Values(-75, -50, -20, 35, 55));

TEST(ClosedLoop, FollowsACallerWhoMoves) {
  TestWorld world(Hall(), {}, {1.0, 1.0, 0.0});
  world.PutTag("caller", {4.0, 5.0});
  world.CallByTag("caller");
  world.Run(4.0);
  for (double x = 4.0; x < 9.0; x += 0.25) {
    world.PutTag("caller", {x, 5.0});
    world.Run(0.7);
  }
  ASSERT_TRUE(world.RunToEnd(40.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived);
  EXPECT_LT((world.position() - Eigen::Vector2d(8.75, 5.0)).norm(), 1.2);
}

TEST(ClosedLoop, StopsBesideACallerWhoIsInItsWay) {
  TestWorld world(Hall(), {}, {1.0, 3.0, 0.0});
  world.people.push_back({{7.0, 3.0}, {0.0, 0.0}, 0.25});
  world.PutTag("caller", {7.0, 3.0}, 12.0);
  world.CallByTag("caller");
  ASSERT_TRUE(world.RunToEnd(60.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_LT((world.position() - Eigen::Vector2d(7.0, 3.0)).norm(), 1.2);
  EXPECT_FALSE(world.has_collided());
}

TEST(ClosedLoop, GivesUpWhenThePlanHasNoWay) {
  FloorPlan plan = Hall();
  plan.walls.push_back({{5, 0}, {5, 6}, std::nullopt});
  TestWorld world(plan, {}, {1.0, 3.0, 0.0});
  world.CallTo({8.0, 3.0});
  ASSERT_TRUE(world.RunToEnd(20.0));
  EXPECT_EQ(world.status().state, NavigatorState::kGaveUp);
  EXPECT_NE(world.status().detail.find("floor plan"), std::string::npos);
  EXPECT_LT(world.driven_m(), 0.1);
}

TEST(ClosedLoop, GivesUpWhenTheDoorTurnsOutToBeBlocked) {
  TestWorld world(TwoRooms(3.0, 0.9), {Box(5.0, 3.0, 0.3, 1.0)}, {1.0, 3.0, 0.0});
  world.CallTo({8.0, 3.0});
  ASSERT_TRUE(world.RunToEnd(180.0));
  EXPECT_EQ(world.status().state, NavigatorState::kGaveUp);
  EXPECT_FALSE(world.status().detail.empty());
  EXPECT_FALSE(world.has_collided()) << world.closest_m();
}

TEST(ClosedLoop, ComesOutOfADeadEndThatThePlanDoesNotShow) {
  // A pocket of furniture, open towards the robot, on the straight way.
  TestWorld world(Hall(),
                  {Box(6.0, 3.0, 0.2, 2.4), Box(5.0, 4.1, 2.2, 0.2), Box(5.0, 1.9, 2.2, 0.2)},
                  {1.0, 3.0, 0.0});
  world.CallTo({8.5, 3.0});
  ASSERT_TRUE(world.RunToEnd(120.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_FALSE(world.has_collided()) << world.closest_m();
}

TEST(ClosedLoop, PointInAWallIsRefusedOrAnsweredFromBeside) {
  FloorPlan plan = Hall();
  plan.obstacles.push_back(Box(7.0, 3.0, 4.0, 4.0));
  TestWorld inside(plan, {}, {1.0, 3.0, 0.0});
  inside.CallTo({7.0, 3.0});  // in the middle of a block: nowhere near can be stood
  ASSERT_TRUE(inside.RunToEnd(20.0));
  EXPECT_EQ(inside.status().state, NavigatorState::kGaveUp);

  TestWorld edge(plan, {}, {1.0, 3.0, 0.0});
  edge.CallTo({5.1, 3.0});  // 10 cm inside: beside it is near enough
  ASSERT_TRUE(edge.RunToEnd(40.0));
  EXPECT_EQ(edge.status().state, NavigatorState::kArrived);
  EXPECT_FALSE(edge.has_collided());
}

TEST(ClosedLoop, PointOutsideThePlanIsRefused) {
  TestWorld world(Hall(), {}, {1.0, 3.0, 0.0});
  world.CallTo({50.0, 3.0});
  EXPECT_EQ(world.status().state, NavigatorState::kGaveUp);
  world.Run(1.0);
  EXPECT_EQ(world.driven_m(), 0.0);
}

TEST(ClosedLoop, NewCallReplacesTheOldAndCancelStops) {
  TestWorld world(Hall(), {}, {5.0, 3.0, 0.0});
  world.CallTo({9.0, 3.0});
  world.Run(3.0);
  world.CallTo({1.0, 3.0});
  world.Run(8.0);
  EXPECT_LT(world.position().x(), 5.5);
  EXPECT_LT(world.status().goal.x(), 2.0);
  world.navigator().OnCall(world.now(), Call{});
  world.Run(2.0);
  EXPECT_EQ(world.status().state, NavigatorState::kIdle);
  const double driven = world.driven_m();
  world.Run(2.0);
  EXPECT_EQ(world.driven_m(), driven);
}

TEST(ClosedLoop, OfTwoCallsAtOnceTheSecondHolds) {
  TestWorld world(Hall(), {}, {5.0, 3.0, 0.0});
  world.PutTag("caller", {9.0, 3.0});
  world.CallByTag("caller");
  world.CallTo({1.0, 3.0});
  double farthest = 0.0;
  world.on_command = [&](const Velocity&) {
    farthest = std::max(farthest, world.status().goal.x());
  };
  ASSERT_TRUE(world.RunToEnd(60.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived);
  EXPECT_LT(world.position().x(), 1.7);
  EXPECT_LT(farthest, 2.0) << "it never made for the first";
}

TEST(ClosedLoop, ScansListedFromLeftToRightAreAsGood) {
  TestWorld world(TwoRooms(3.0, 0.9), {Box(3.0, 2.0, 0.6, 0.6)}, {1.0, 3.0, 0.0});
  world.tamper_scan = [](Scan& scan) {
    scan.first_bearing_rad = scan.Bearing(scan.ranges_m.size() - 1);
    scan.bearing_step_rad = -scan.bearing_step_rad;
    std::reverse(scan.ranges_m.begin(), scan.ranges_m.end());
    std::reverse(scan.ground_seen_m.begin(), scan.ground_seen_m.end());
    return true;
  };
  world.CallTo({8.0, 3.0});
  ASSERT_TRUE(world.RunToEnd(60.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_FALSE(world.has_collided());
}

TEST(ClosedLoop, GoesAfterATagThatLeavesUntilItIsCancelled) {
  TestWorld world(Hall(), {}, {1.0, 3.0, 0.0});
  world.PutTag("caller", {4.0, 3.0});
  world.CallByTag("caller");
  ASSERT_TRUE(world.RunToEnd(40.0));
  const double driven = world.driven_m();
  world.PutTag("caller", {4.3, 3.2});  // a step aside
  world.Run(5.0);
  EXPECT_EQ(world.status().state, NavigatorState::kArrived);
  EXPECT_NEAR(world.driven_m(), driven, 0.1);
  world.PutTag("caller", {8.5, 5.0});
  ASSERT_TRUE(world.Run(5.0, [&] { return world.status().state == NavigatorState::kDriving; }));
  ASSERT_TRUE(world.RunToEnd(40.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived);
  EXPECT_LT((world.position() - Eigen::Vector2d(8.5, 5.0)).norm(), 1.3);
  world.navigator().OnCall(world.now(), Call{});
  world.PutTag("caller", {2.0, 1.0});
  world.Run(5.0);
  EXPECT_EQ(world.status().state, NavigatorState::kIdle);
}

// As likely as can be at two places of the hall, and nowhere else.
PossibleArea TwoPlaces(Utime utime, const Eigen::Vector2d& first, const Eigen::Vector2d& second) {
  PossibleArea area;
  area.utime = utime;
  area.tag = "caller";
  area.grid = GridGeometry::Covering({0.0, 0.0}, {10.0, 6.0}, 0.5);
  for (int cell = 0; cell < area.grid.size(); ++cell) {
    const Eigen::Vector2d point = area.grid.Centre(cell);
    const double away = std::min((point - first).norm(), (point - second).norm());
    area.credible_level.push_back(static_cast<std::uint8_t>(std::min(254.0, 120.0 * away)));
  }
  return area;
}

TEST(ClosedLoop, WhoCallsAgainIsSearchedForElsewhereInThePossibleArea) {
  TestWorld world(Hall(), {}, {1.0, 3.0, 0.0});
  world.PutTag("caller", {4.0, 3.0}, 9.0);
  world.CallByTag("caller");
  ASSERT_TRUE(world.RunToEnd(40.0));
  EXPECT_LT((world.position() - Eigen::Vector2d(4.0, 3.0)).norm(), 1.6);
  world.navigator().OnPossibleArea(world.now(),
                                   TwoPlaces(world.now().utime, {4.0, 3.0}, {8.0, 4.5}));
  world.CallByTag("caller");
  EXPECT_EQ(world.status().state, NavigatorState::kDriving);
  ASSERT_TRUE(world.RunToEnd(40.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived);
  EXPECT_LT((world.position() - Eigen::Vector2d(8.0, 4.5)).norm(), 1.6);
}

TEST(ClosedLoop, GoesToThePartOfThePossibleAreaThatItCanReach) {
  FloorPlan plan = Hall();
  plan.walls.push_back({{6, 0}, {6, 6}, std::nullopt});
  TestWorld world(plan, {}, {1.0, 3.0, 0.0});
  world.PutTag("caller", {8.5, 3.0}, 20.0);
  world.CallByTag("caller");
  world.navigator().OnPossibleArea(world.now(),
                                   TwoPlaces(world.now().utime, {8.5, 3.0}, {4.5, 4.5}));
  ASSERT_TRUE(world.RunToEnd(60.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_LT((world.position() - Eigen::Vector2d(4.5, 4.5)).norm(), 1.8);
}

TEST(ClosedLoop, WorksWithoutOdometry) {
  TestWorldOptions options;
  options.has_odometry = false;
  TestWorld world(TwoRooms(3.0, 0.9), {Box(3.0, 2.9, 0.5, 0.5)}, {1.0, 3.0, 0.0}, options);
  world.CallTo({8.0, 4.0});
  ASSERT_TRUE(world.RunToEnd(90.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_FALSE(world.has_collided()) << world.closest_m();
}

// A scan or pose that goes wrong on the way: the robot stands for a named reason, and goes on by
// itself.
struct Fault {
  const char* name;
  const char* reason;
  double within_s;  // standing by then
  void (*begin)(TestWorld&);
};

class Faults : public ::testing::TestWithParam<Fault> {};

TEST_P(Faults, StopTheRobotForANamedReasonAndItResumes) {
  const Fault& fault = GetParam();
  // With boxes beside the way, so that scans have something to show.
  TestWorld world(Hall(), {Box(4.0, 1.0, 1.0, 1.0), Box(6.0, 5.0, 1.0, 1.0)}, {1.0, 3.0, 0.0});
  world.CallTo({9.0, 3.0});
  ASSERT_TRUE(world.Run(20.0, [&] { return world.position().x() > 2.5; }));
  EXPECT_GT(world.speed(), 0.4);
  fault.begin(world);
  bool is_named = false;
  world.Run(fault.within_s, [&] {
    is_named = is_named || world.status().stop_reason == fault.reason;
    return false;
  });
  EXPECT_TRUE(is_named) << "instead: " << world.status().stop_reason;
  EXPECT_LT(std::abs(world.speed()), 0.01);
  world.tamper_scan = [](Scan&) { return true; };
  world.tamper_pose = [](Utime&, Pose2&) { return true; };
  world.tamper_odometry = [](Utime&, Pose2&) { return true; };
  ASSERT_TRUE(world.RunToEnd(60.0));
  EXPECT_EQ(world.status().state, NavigatorState::kArrived) << world.status().detail;
  EXPECT_FALSE(world.has_collided());
}

INSTANTIATE_TEST_SUITE_P(
    All, Faults,
    ::testing::Values(
        Fault{"scan_lost", stop_reason::kScanStale, 1.5,
              [](TestWorld& world) { world.tamper_scan = [](Scan&) { return false; }; }},
        // The sender repeats its last message: it arrives, but is old.
        Fault{"scan_repeated", stop_reason::kScanStale, 1.5,
              [](TestWorld& world) {
                world.tamper_scan = [last = std::optional<Scan>()](Scan& scan) mutable {
                  if (!last) last = scan;
                  scan = *last;
                  return true;
                };
              }},
        // The picture stands still, but is dated anew.
        Fault{"scan_frozen", stop_reason::kScanFrozen, 3.0,
              [](TestWorld& world) {
                world.tamper_scan = [last = std::optional<Scan>()](Scan& scan) mutable {
                  if (!last) last = scan;
                  const Utime utime = scan.utime;
                  scan = *last;
                  scan.utime = utime;
                  return true;
                };
              }},
        Fault{"scan_all_undetermined", stop_reason::kGroundNotSeen, 12.0,
              [](TestWorld& world) {
                world.tamper_scan = [](Scan& scan) {
                  for (float& range : scan.ranges_m)
                    range = std::numeric_limits<float>::quiet_NaN();
                  for (float& seen : scan.ground_seen_m) seen = 0.0F;
                  return true;
                };
              }},
        Fault{"scan_negative", stop_reason::kScanInvalid, 1.5,
              [](TestWorld& world) {
                world.tamper_scan = [](Scan& scan) {
                  scan.ranges_m[10] = -1.0F;
                  return true;
                };
              }},
        Fault{"scan_half_missing", stop_reason::kScanInvalid, 1.5,
              [](TestWorld& world) {
                world.tamper_scan = [](Scan& scan) {
                  scan.ranges_m.resize(scan.ranges_m.size() / 2);
                  return true;
                };
              }},
        // One half of the picture is dark: who comes from there would not be seen.
        Fault{"scan_half_undetermined", stop_reason::kGroundNotSeen, 3.0,
              [](TestWorld& world) {
                world.tamper_scan = [](Scan& scan) {
                  for (std::size_t ray = scan.ranges_m.size() / 2; ray < scan.ranges_m.size();
                       ++ray) {
                    scan.ranges_m[ray] = std::numeric_limits<float>::quiet_NaN();
                    scan.ground_seen_m[ray] = 0.0F;
                  }
                  return true;
                };
              }},
        Fault{"scan_cut_in_half", stop_reason::kGroundNotSeen, 3.0,
              [](TestWorld& world) {
                world.tamper_scan = [](Scan& scan) {
                  scan.ranges_m.resize(scan.ranges_m.size() / 2);
                  scan.ground_seen_m.resize(scan.ranges_m.size());
                  return true;
                };
              }},
        Fault{"scan_time_reversed", stop_reason::kScanInvalid, 1.5,
              [](TestWorld& world) {
                world.tamper_scan = [step = Utime{0}](Scan& scan) mutable {
                  scan.utime -= (step += 150'000);
                  return true;
                };
              }},
        Fault{"scan_from_the_future", stop_reason::kScanInvalid, 1.5,
              [](TestWorld& world) {
                world.tamper_scan = [](Scan& scan) {
                  scan.utime += 60'000'000;
                  return true;
                };
              }},
        Fault{"pose_lost", stop_reason::kPoseStale, 3.0,
              [](TestWorld& world) { world.tamper_pose = [](Utime&, Pose2&) { return false; }; }},
        Fault{"pose_old", stop_reason::kPoseStale, 1.5,
              [](TestWorld& world) {
                world.tamper_pose = [](Utime& utime, Pose2&) {
                  utime -= 3'000'000;
                  return true;
                };
              }},
        Fault{"pose_outside_the_plan", stop_reason::kPoseInvalid, 3.0,
              [](TestWorld& world) {
                world.tamper_pose = [](Utime&, Pose2& pose) {
                  pose.x += 50.0;
                  return true;
                };
              }},
        Fault{
            "odometry_lost", stop_reason::kOdometryStale, 2.0,
            [](TestWorld& world) { world.tamper_odometry = [](Utime&, Pose2&) { return false; }; }},
        Fault{"odometry_old", stop_reason::kOdometryStale, 2.0,
              [](TestWorld& world) {
                world.tamper_odometry = [](Utime& utime, Pose2&) {
                  utime -= 800'000;
                  return true;
                };
              }},
        Fault{"odometry_no_number", stop_reason::kOdometryInvalid, 1.5,
              [](TestWorld& world) {
                world.tamper_odometry = [](Utime&, Pose2& pose) {
                  pose.theta = std::nan("");
                  return true;
                };
              }},
        Fault{"odometry_jumps", stop_reason::kOdometryInvalid, 1.5,
              [](TestWorld& world) {
                world.tamper_odometry = [odd = false](Utime&, Pose2& pose) mutable {
                  odd = !odd;
                  if (odd) pose.y += 3.0;
                  return true;
                };
              }},
        // The wheels are said to stand while they are told to turn.
        Fault{"odometry_frozen", stop_reason::kOdometryFrozen, 2.5,
              [](TestWorld& world) {
                world.tamper_odometry = [last = std::optional<Pose2>()](Utime&,
                                                                        Pose2& pose) mutable {
                  if (!last) last = pose;
                  pose = *last;
                  return true;
                };
              }},
        Fault{"pose_jumps", stop_reason::kPoseJump, 1.5,
              [](TestWorld& world) {
                world.tamper_pose = [odd = false](Utime&, Pose2& pose) mutable {
                  odd = !odd;
                  if (odd) pose.x += 2.0;
                  return true;
                };
              }}),
    [](const auto& fault) { return std::string(fault.param.name); });

TEST(ClosedLoop, CommandsKeepTheLimits) {
  const NavigatorOptions options = TestWorld::DefaultNavigator();
  TestWorldOptions noise;
  noise.faults.range_noise = 0.03;
  noise.faults.phantom_rate = 0.1;
  TestWorld world(TwoRooms(3.0, 0.9), {Box(3.0, 2.9, 0.5, 0.5)}, {1.0, 3.0, 2.0}, noise, options);
  Velocity last;
  double largest_step = 0.0;
  double largest_turn_step = 0.0;
  world.on_command = [&](const Velocity& velocity) {
    EXPECT_LE(std::abs(velocity.linear_mps), options.robot.max_speed_mps + 1e-9);
    EXPECT_LE(std::abs(velocity.angular_radps), options.robot.max_turn_radps + 1e-9);
    largest_step = std::max(largest_step, std::abs(velocity.linear_mps - last.linear_mps));
    largest_turn_step =
        std::max(largest_turn_step, std::abs(velocity.angular_radps - last.angular_radps));
    last = velocity;
  };
  world.CallTo({8.0, 4.0});
  ASSERT_TRUE(world.RunToEnd(90.0));
  EXPECT_LE(largest_step, options.robot.max_acceleration_mps2 * 0.05 + 1e-9);
  EXPECT_LE(largest_turn_step, options.robot.max_turn_acceleration_radps2 * 0.05 + 1e-9);
}

}  // namespace
}  // namespace beckon
