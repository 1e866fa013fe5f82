// The navigator's parts, each alone.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "services/navigator/destination.hpp"
#include "services/navigator/local_frame.hpp"
#include "services/navigator/recovery.hpp"
#include "services/navigator/resume_file.hpp"
#include "services/navigator/route_planner.hpp"
#include "services/navigator/safety_monitor.hpp"
#include "services/navigator/stop_reasons.hpp"
#include "services/navigator/surroundings.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

FloorPlan Room(double width, double depth) {
  FloorPlan plan;
  plan.min = {0.0, 0.0};
  plan.max = {width, depth};
  return plan;
}

// 181 rays over 180 degrees that see this far, and hit something there where `is_hit`.
Scan FlatScan(Utime utime, float range, bool is_hit) {
  Scan scan;
  scan.utime = utime;
  scan.first_bearing_rad = RadiansFromDegrees(-90.0);
  scan.bearing_step_rad = RadiansFromDegrees(1.0);
  scan.ranges_m.assign(181, is_hit ? range : kInf);
  scan.ground_seen_m.assign(181, range);
  return scan;
}

// ---- RoutePlanner

TEST(RoutePlanner, StraightWhereNothingIsInTheWay) {
  const RoutePlanner planner(Room(10.0, 4.0), {}, {});
  const Route route = planner.Plan({1.0, 2.0}, {{9.0, 2.0}, 0.1}, {});
  ASSERT_TRUE(route.is_found);
  EXPECT_NEAR(route.length_m, 8.0, 0.1);
  EXPECT_LE(route.points.size(), 3U);
}

TEST(RoutePlanner, DiagonalIsNotAStaircase) {
  const RoutePlanner planner(Room(10.0, 10.0), {}, {});
  const Route route = planner.Plan({1.0, 1.0}, {{9.0, 4.0}, 0.1}, {});
  ASSERT_TRUE(route.is_found);
  EXPECT_NEAR(route.length_m, std::hypot(8.0, 3.0), 0.1);
}

TEST(RoutePlanner, KeepsTheMiddleOfADoor) {
  FloorPlan plan = Room(10.0, 6.0);
  plan.walls.push_back({{5.0, 0.0}, {5.0, 2.0}, std::nullopt});
  plan.walls.push_back({{5.0, 2.9}, {5.0, 6.0}, std::nullopt});
  const RoutePlanner planner(plan, {}, {});
  const Route route = planner.Plan({1.0, 5.0}, {{9.0, 5.0}, 0.1}, {});
  ASSERT_TRUE(route.is_found);
  // Where the route crosses the wall's line.
  for (std::size_t i = 1; i < route.points.size(); ++i) {
    const Eigen::Vector2d& a = route.points[i - 1];
    const Eigen::Vector2d& b = route.points[i];
    if (a.x() > 5.0 || b.x() < 5.0) continue;
    const double y = a.y() + (5.0 - a.x()) / (b.x() - a.x()) * (b.y() - a.y());
    EXPECT_NEAR(y, 2.45, 0.12);
  }
  // Not longer than the taut string round the door's corner by more than a few percent.
  const double taut = std::hypot(4.0, 5.0 - 2.65) * 2.0;
  EXPECT_LT(route.length_m, 1.1 * taut);
}

TEST(RoutePlanner, DoorNarrowerThanTheRobotIsNoWay) {
  FloorPlan plan = Room(10.0, 6.0);
  plan.walls.push_back({{5.0, 0.0}, {5.0, 2.0}, std::nullopt});
  plan.walls.push_back({{5.0, 2.15}, {5.0, 6.0}, std::nullopt});
  const RoutePlanner planner(plan, {}, {});
  const Route route = planner.Plan({1.0, 3.0}, {{9.0, 3.0}, 0.1}, {});
  EXPECT_FALSE(route.is_found);
  EXPECT_FALSE(route.plan_has_way);
}

TEST(RoutePlanner, GoesRoundWhatWasSeenAndForgetsItInTime) {
  RouteOptions options;
  options.memory_s = 30.0;
  RoutePlanner planner(Room(10.0, 4.0), {}, options);
  // A grid of 4 x 4 m in the middle of the room, with a bar of 2 m across the way.
  SeenGrid seen;
  seen.grid.resolution_m = 0.1;
  seen.grid.width = seen.grid.height = 40;
  seen.occupancy.assign(1600, 0);
  for (int row = 10; row < 30; ++row) {
    seen.occupancy[static_cast<std::size_t>(row * 40 + 20)] = 200;
  }
  Instant now;
  now.steady = std::chrono::seconds(100);
  planner.Remember(seen, {3.0, 0.0, 0.0}, now);
  const RouteGoal goal{{9.0, 2.0}, 0.1};
  const Route round = planner.Plan({1.0, 2.0}, goal, now);
  ASSERT_TRUE(round.is_found);
  EXPECT_GT(round.length_m, 8.2);
  for (const Eigen::Vector2d& point : round.points) {
    const bool is_near = std::abs(point.x() - 5.05) < 0.2 && point.y() > 1.0 && point.y() < 3.0;
    EXPECT_FALSE(is_near);
  }
  now.steady += std::chrono::seconds(31);
  EXPECT_NEAR(planner.Plan({1.0, 2.0}, goal, now).length_m, 8.0, 0.1);
}

TEST(RoutePlanner, GoesToLookWhereTheOnlyDoorSeemsBlockedFromAfar) {
  FloorPlan plan = Room(10.0, 4.0);
  plan.walls.push_back({{5.0, 0.0}, {5.0, 1.5}, std::nullopt});
  plan.walls.push_back({{5.0, 2.5}, {5.0, 4.0}, std::nullopt});
  RoutePlanner planner(plan, {}, {});
  SeenGrid seen;
  seen.grid.resolution_m = 0.1;
  seen.grid.width = seen.grid.height = 40;
  seen.occupancy.assign(1600, 0);
  for (int row = 0; row < 40; ++row) {
    seen.occupancy[static_cast<std::size_t>(row * 40 + 20)] = 200;  // across the door, at x = 5.05
  }
  Instant now;
  now.steady = std::chrono::seconds(100);
  planner.Remember(seen, {3.0, 0.0, 0.0}, now);
  const RouteGoal goal{{9.0, 2.0}, 0.1};
  const Route from_afar = planner.Plan({2.0, 2.0}, goal, now);
  EXPECT_TRUE(from_afar.is_found);
  EXPECT_TRUE(from_afar.is_doubtful);
  const Route from_near = planner.Plan({4.2, 2.0}, goal, now);
  EXPECT_FALSE(from_near.is_found) << "what is seen from near is there";
  EXPECT_TRUE(from_near.plan_has_way);
}

TEST(RoutePlanner, PrefersTheCallersSideOfAWall) {
  FloorPlan plan = Room(10.0, 6.0);
  // Caller at (5, 3.4), just behind a wall that the robot would have to go round.
  plan.walls.push_back({{2.0, 3.0}, {8.0, 3.0}, std::nullopt});
  const RoutePlanner planner(plan, {}, {});
  const Route route = planner.Plan({5.0, 1.0}, {{5.0, 3.6}, 1.6}, {});
  ASSERT_TRUE(route.is_found);
  EXPECT_GT(route.points.back().y(), 3.0);
}

// ---- Surroundings

TEST(Surroundings, FreeWayIsMeasuredForTheDisc) {
  RobotOptions robot;
  Surroundings surroundings(robot);
  const Pose2 base;
  surroundings.SetScan(FlatScan(1, 1.5F, true), base);
  surroundings.Update({}, base);
  const ArcView view = LookAlong(surroundings, robot, base, 0.0, 1, 3.0, 0.0);
  EXPECT_NEAR(view.free_m, 1.5 - robot.radius_m, 0.08);
  // To the side nothing was seen.
  const ArcView back = LookAlong(surroundings, robot, base, 0.0, -1, 1.0, 0.0);
  EXPECT_LT(back.seen_m, 0.3);
  EXPECT_NEAR(surroundings.NearestInScan(base), 1.5, 1e-5);
}

TEST(Surroundings, SeenFloorEndsWhereTheScanEnds) {
  RobotOptions robot;
  Surroundings surroundings(robot);
  surroundings.SetScan(FlatScan(1, 2.0F, false), {});
  surroundings.Update({}, {});
  const ArcView view = LookAlong(surroundings, robot, {}, 0.0, 1, 3.0, 0.0);
  EXPECT_EQ(view.free_m, 3.0);
  EXPECT_NEAR(view.seen_m, 2.0 - robot.radius_m, 0.15);
}

TEST(Surroundings, ObstacleThatMayBeNearerIsTakenAsNear) {
  RobotOptions robot;
  Surroundings surroundings(robot);
  Scan scan = FlatScan(1, 0.6F, true);
  scan.ground_seen_m.assign(181, 0.0F);  // not even the nearest visible pixel is ground
  surroundings.SetScan(scan, {});
  surroundings.Update({}, {});
  EXPECT_LT(LookAlong(surroundings, robot, {}, 0.0, 1, 1.0, 0.0).free_m, 0.15);
}

// As above, from a wall that was seen a moment ago: coming near to it is nobody stepping in.
TEST(Surroundings, KnownObstacleTooNearForTheCameraStaysWhereItIs) {
  RobotOptions robot;
  Surroundings surroundings(robot);
  surroundings.SetScan(FlatScan(1, 0.65F, true), {});
  surroundings.Update({}, {});
  Scan scan = FlatScan(2, 0.6F, true);
  scan.ground_seen_m.assign(181, 0.0F);
  SeenGrid grid;  // remembers the wall, which is round
  grid.grid.resolution_m = 0.05;
  grid.grid.width = grid.grid.height = 40;
  grid.grid_from_robot = {1.0, 1.0, 0.0};
  grid.occupancy.assign(1600, 0);
  for (int cell = 0; cell < grid.grid.size(); ++cell) {
    const double distance = (grid.grid.Centre(cell) - grid.grid_from_robot.translation()).norm();
    if (distance > 0.64) grid.occupancy[static_cast<std::size_t>(cell)] = 200;
  }
  surroundings.SetGrid({}, grid, {});
  surroundings.SetScan(scan, {});
  surroundings.Update({}, {});
  EXPECT_NEAR(LookAlong(surroundings, robot, {}, 0.0, 1, 1.0, 0.0).free_m, 0.65 - robot.radius_m,
              0.08);
}

TEST(Surroundings, WhatIsTooNearHoldsTheLongerTheMoreScansShowIt) {
  RobotOptions robot;
  Scan near = FlatScan(1, 0.6F, true);
  near.ground_seen_m.assign(181, 0.0F);
  Scan undetermined = near;
  undetermined.ranges_m.assign(181, std::numeric_limits<float>::quiet_NaN());
  const auto free_after = [&](int scans, double seconds) {
    Surroundings surroundings(robot);
    surroundings.SetScan(FlatScan(1, 2.0F, false), {});
    surroundings.Update({}, {});
    for (int i = 0; i < scans; ++i) {
      surroundings.SetScan(near, {});
      surroundings.Update({}, {});
    }
    Instant later;
    later.steady += std::chrono::milliseconds(std::lround(1e3 * seconds));
    surroundings.SetScan(undetermined, {});
    surroundings.Update(later, {});
    return LookAlong(surroundings, robot, {}, 0.0, 1, 1.0, 0.0).free_m;
  };
  EXPECT_LT(free_after(1, 0.9), 0.15);
  EXPECT_EQ(free_after(1, 1.1), 1.0) << "one phantom";
  EXPECT_LT(free_after(5, 4.9), 0.15);
  EXPECT_EQ(free_after(100, 10.1), 1.0) << "never for long";
}

// All floor around a robot at the origin, as GRID remembers it.
SeenGrid FreeGrid() {
  SeenGrid grid;
  grid.grid.resolution_m = 0.05;
  grid.grid.width = grid.grid.height = 80;
  grid.grid_from_robot = {2.0, 2.0, 0.0};
  grid.occupancy.assign(6400, 0);
  return grid;
}

// Somebody may have come up to it from where the camera does not look.
TEST(Surroundings, FloorBesideARobotThatHasStoodIsSeenAnew) {
  RobotOptions robot;
  ManualClock clock;
  Surroundings surroundings(robot);
  Scan ahead = FlatScan(1, 2.0F, false);  // the camera looks to the right only
  ahead.ranges_m.resize(90);
  ahead.ground_seen_m.resize(90);
  Pose2 base;
  const auto seen_m = [&](int direction) {
    surroundings.SetGrid(clock.Now(), FreeGrid(), {});
    surroundings.SetScan(ahead, base);
    surroundings.Update(clock.Now(), base);
    return LookAlong(surroundings, robot, base, 0.0, direction, 0.5, 0.04).seen_m;
  };
  EXPECT_EQ(seen_m(1), 0.5);
  clock.Advance(std::chrono::milliseconds(900));
  EXPECT_EQ(seen_m(1), 0.5) << "it has hardly stopped";
  clock.Advance(std::chrono::milliseconds(200));
  EXPECT_LT(seen_m(1), 0.05) << "to its left somebody may stand";
  EXPECT_LT(seen_m(-1), 0.05);
  // It looks there.
  base.theta = RadiansFromDegrees(90.0);
  seen_m(1);
  base.theta = 0.0;
  EXPECT_EQ(seen_m(1), 0.5);
  // While it waits for something, nothing more is asked of it; in the long run it is.
  clock.Advance(std::chrono::seconds(2));
  EXPECT_EQ(seen_m(1), 0.5);
  clock.Advance(std::chrono::seconds(30));
  EXPECT_LT(seen_m(1), 0.05);
}

TEST(Surroundings, MayMoveAwayFromWhatItTouches) {
  RobotOptions robot;
  Surroundings surroundings(robot);
  surroundings.SetScan(FlatScan(1, 0.27F, true), {});
  surroundings.Update({}, {});
  EXPECT_LT(LookAlong(surroundings, robot, {}, 0.0, 1, 0.5, 0.05).free_m, 0.08);
  EXPECT_EQ(LookAlong(surroundings, robot, {}, 0.0, -1, 0.5, 0.05).free_m, 0.5);
}

// ---- PathFollower

// Somebody stands right before it on the left: straight on would come nearer to him still.
TEST(PathFollower, TurnsToAHeadingThatIsFreeWhereNoArcIs) {
  RobotOptions robot;
  Surroundings surroundings(robot);
  SeenGrid grid = FreeGrid();
  for (int cell = 0; cell < grid.grid.size(); ++cell) {
    const Eigen::Vector2d place = grid.grid.Centre(cell) - Eigen::Vector2d(2.0, 2.0);
    if ((place - Eigen::Vector2d(0.25, 0.40)).norm() < 0.2) {
      grid.occupancy[static_cast<std::size_t>(cell)] = 200;
    }
  }
  surroundings.SetGrid({}, grid, {});
  Pose2 base;
  surroundings.Update({}, base);
  PathFollower follower(robot, {});
  const std::vector<Eigen::Vector2d> route = {{0.0, 0.0}, {1.5, 0.0}};
  ASSERT_LT(LookAlong(surroundings, robot, base, 0.0, 1, 0.5, 0.04).free_m, 0.1);
  double turned_rad = 0.0;
  constexpr double kStepS = 0.05;
  for (int i = 0; i < 200 && base.x < 1.0; ++i) {
    const Step step = follower.Follow({}, route, base, surroundings);
    EXPECT_EQ(step.blocked_by, "") << i;
    base =
        base * Pose2{kStepS * step.velocity.linear_mps, 0.0, kStepS * step.velocity.angular_radps};
    turned_rad = std::min(turned_rad, base.theta);
    surroundings.Update({}, base);
    ASSERT_GT(surroundings.Clearance(base.translation()), robot.radius_m - 0.02);
  }
  EXPECT_LT(turned_rad, -0.15) << "to the right";
  EXPECT_GT(base.x, 1.0);
}

// ---- Recovery

// In a door of 0.8 m through a wall along the y axis, all floor around it seen.
class RecoveryInADoor : public ::testing::Test {
 protected:
  RecoveryInADoor() {
    SeenGrid grid = FreeGrid();
    for (int row = 0; row < 80; ++row) {
      const double y = grid.grid.Centre(40, row).y() - 2.0;
      if (std::abs(y) > 0.4) grid.occupancy[static_cast<std::size_t>(row * 80 + 40)] = 200;
    }
    surroundings_.SetGrid({}, grid, {});
    surroundings_.Update({}, {});
  }

  RobotOptions robot_;
  FollowerOptions follower_options_;
  PathFollower follower_{robot_, follower_options_};
  SafetyMonitor monitor_{robot_, {}};
  Surroundings surroundings_{robot_};
  Recovery recovery_{robot_, follower_, monitor_, follower_options_.margin_m};
};

TEST_F(RecoveryInADoor, TurnsToWhereItCanBackOut) {
  Pose2 base{0.05, 0.0, 1.2};  // straight back is a post
  ASSERT_LT(LookAlong(surroundings_, robot_, base, 0.0, -1, 0.4, 0.04).free_m, 0.4);
  ASSERT_TRUE(recovery_.Start(base, surroundings_));
  EXPECT_EQ(recovery_.Description(), "backing out");
  constexpr double kStepS = 0.05;
  double backed_m = 0.0;
  for (int i = 0; i < 400; ++i) {
    const auto velocity = recovery_.Continue(base, surroundings_);
    if (!velocity) break;
    EXPECT_LE(velocity->linear_mps, 0.0);
    if (velocity->linear_mps < 0.0) {
      EXPECT_EQ(velocity->angular_radps, 0.0);
    }
    base.theta += kStepS * velocity->angular_radps;
    base.x += kStepS * velocity->linear_mps * std::cos(base.theta);
    base.y += kStepS * velocity->linear_mps * std::sin(base.theta);
    backed_m -= kStepS * velocity->linear_mps;
  }
  EXPECT_FALSE(recovery_.is_active());
  EXPECT_NEAR(backed_m, 0.4, 0.1);
  EXPECT_GT(surroundings_.Clearance(base.translation()), robot_.radius_m);
}

TEST_F(RecoveryInADoor, AttemptsEndUntilItGetsAway) {
  const Pose2 base{0.05, 0.0, 0.0};
  for (int i = 0; i < 6; ++i) EXPECT_TRUE(recovery_.Start(base, surroundings_)) << i;
  EXPECT_FALSE(recovery_.Start(base, surroundings_));
  recovery_.NoteProgress({0.5, 0.0, 0.0});
  EXPECT_FALSE(recovery_.Start(base, surroundings_));
  recovery_.NoteProgress({0.8, 0.0, 0.0});
  EXPECT_TRUE(recovery_.Start(base, surroundings_));
}

TEST(Recovery, LooksRoundWhereItDoesNotKnowTheWayBackAndThenBacksOut) {
  RobotOptions robot;
  FollowerOptions options;
  const PathFollower follower(robot, options);
  const SafetyMonitor monitor(robot, {});
  Recovery recovery(robot, follower, monitor, options.margin_m);
  Surroundings surroundings(robot);
  const Scan wall = FlatScan(1, 0.3F, true);  // close before it: back would be first
  surroundings.SetScan(wall, {});
  surroundings.Update({}, {});
  ASSERT_TRUE(recovery.Start({}, surroundings));
  EXPECT_EQ(recovery.Description(), "looking around");
  surroundings.SetGrid({}, FreeGrid(), {});  // that has shown free floor
  surroundings.Update({}, {});
  ASSERT_TRUE(recovery.Start({}, surroundings));
  EXPECT_EQ(recovery.Description(), "backing out");
  ASSERT_TRUE(recovery.Start({}, surroundings));
  EXPECT_EQ(recovery.Description(), "looking around");
}

// ---- SafetyMonitor

class SafetyMonitorTest : public ::testing::Test {
 protected:
  // Everything is well: a fresh scan of this free range ahead, a fresh pose.
  void Feed(float range = 5.0F, bool is_hit = false) {
    const Scan scan = FlatScan(clock_.Now().utime, range, is_hit);
    monitor_.OnScan(clock_.Now(), scan, {});
    monitor_.OnPose(clock_.Now(), clock_.Now().utime, {});
    surroundings_.SetScan(scan, {});
    surroundings_.Update(clock_.Now(), {});
  }
  SafetyMonitor::Verdict Pass(const Velocity& wanted) {
    clock_.Advance(std::chrono::milliseconds(50));
    return monitor_.Pass(clock_.Now(), 0.05, wanted, surroundings_, {});
  }

  RobotOptions robot_;
  SafetyMonitor monitor_{robot_, {}};
  Surroundings surroundings_{robot_};
  ManualClock clock_;
};

TEST_F(SafetyMonitorTest, NothingMovesBeforeThereAreScanAndPose) {
  EXPECT_EQ(Pass({0.5, 0.5}).reason, stop_reason::kScanMissing);
  monitor_.OnScan(clock_.Now(), FlatScan(clock_.Now().utime, 5.0F, false), {});
  const auto verdict = Pass({0.5, 0.5});
  EXPECT_EQ(verdict.reason, stop_reason::kPoseMissing);
  EXPECT_EQ(verdict.velocity.linear_mps, 0.0);
  EXPECT_EQ(verdict.velocity.angular_radps, 0.0);
}

TEST_F(SafetyMonitorTest, LimitsSpeedAndAcceleration) {
  double last = 0.0;
  for (int i = 0; i < 60; ++i) {
    Feed();
    const auto verdict = Pass({9.0, 0.0});
    EXPECT_TRUE(verdict.reason.empty()) << verdict.reason;
    EXPECT_LE(verdict.velocity.linear_mps - last, robot_.max_acceleration_mps2 * 0.05 + 1e-9);
    last = verdict.velocity.linear_mps;
  }
  EXPECT_NEAR(last, robot_.max_speed_mps, 1e-9);
  last = 0.0;
  for (int i = 0; i < 60; ++i) {
    Feed();
    const auto verdict = Pass({0.0, -9.0});
    EXPECT_LE(std::abs(verdict.velocity.angular_radps - last),
              robot_.max_turn_acceleration_radps2 * 0.05 + 1e-9);
    last = verdict.velocity.angular_radps;
  }
  EXPECT_NEAR(last, -robot_.max_turn_radps, 1e-9);
}

TEST_F(SafetyMonitorTest, CommandsThatAreNoNumbersStop) {
  Feed();
  const auto verdict = Pass({std::nan(""), 0.1});
  EXPECT_EQ(verdict.reason, stop_reason::kCommandInvalid);
  EXPECT_EQ(verdict.velocity.linear_mps, 0.0);
}

TEST_F(SafetyMonitorTest, AgeIsCheckedOnBothClocks) {
  Feed();
  EXPECT_TRUE(Pass({0.1, 0.0}).reason.empty());
  // A scan that arrives now, but was measured long ago.
  monitor_.OnScan(clock_.Now(), FlatScan(clock_.Now().utime - 600'000, 4.9F, false), {});
  EXPECT_EQ(Pass({0.1, 0.0}).reason, stop_reason::kScanStale);
  // The wall clock is set back: the scan looks young for ever, the steady clock knows better.
  Feed();
  clock_.StepWallClock(std::chrono::milliseconds(-400));
  for (int i = 0; i < 9; ++i) EXPECT_TRUE(Pass({0.1, 0.0}).reason.empty()) << i;
  for (int i = 0; i < 3; ++i) Pass({0.1, 0.0});
  EXPECT_EQ(Pass({0.1, 0.0}).reason, stop_reason::kScanStale);
}

TEST_F(SafetyMonitorTest, PoseMayBeTwoSecondsOld) {
  Feed();
  const auto feed_scan = [&] {
    monitor_.OnScan(clock_.Now(), FlatScan(clock_.Now().utime, 5.0F, false), {});
  };
  for (int i = 0; i < 39; ++i) {
    feed_scan();
    EXPECT_TRUE(Pass({0.1, 0.0}).reason.empty()) << i;
  }
  for (int i = 0; i < 2; ++i) {
    feed_scan();
    Pass({0.1, 0.0});
  }
  feed_scan();
  EXPECT_EQ(Pass({0.1, 0.0}).reason, stop_reason::kPoseStale);
}

TEST_F(SafetyMonitorTest, StopsBeforeAnObstacleWithinTheStoppingDistance) {
  for (int i = 0; i < 30; ++i) {
    Feed();
    Pass({0.5, 0.0});
  }
  ASSERT_NEAR(monitor_.last().linear_mps, 0.5, 1e-9);
  const double stopping = monitor_.StoppingDistance(0.5);
  EXPECT_GT(stopping, 0.25);  // v^2 / 2a
  const auto far = static_cast<float>(robot_.radius_m + stopping + 0.2);
  Feed(far, true);
  EXPECT_TRUE(Pass({0.5, 0.0}).reason.empty());
  const auto near = static_cast<float>(robot_.radius_m + stopping - 0.1);
  Feed(near, true);
  const auto verdict = Pass({0.5, 0.0});
  EXPECT_EQ(verdict.reason, stop_reason::kObstacle);
  EXPECT_LT(verdict.velocity.linear_mps, 0.5);
  // It may still turn on the spot.
  for (int i = 0; i < 30; ++i) {
    Feed(near, true);
    Pass({0.0, 0.5});
  }
  EXPECT_NEAR(monitor_.last().angular_radps, 0.5, 1e-9);
  EXPECT_EQ(monitor_.last().linear_mps, 0.0);
}

TEST_F(SafetyMonitorTest, FloorThatWasNotSeenIsNotDrivenOn) {
  Feed(0.4F, false);
  EXPECT_EQ(Pass({0.5, 0.0}).reason, stop_reason::kNone);  // from standstill: creeps
  for (int i = 0; i < 30; ++i) {
    Feed(0.4F, false);
    Pass({0.5, 0.0});
  }
  EXPECT_LT(monitor_.last().linear_mps, 0.2);
}

TEST(Movers, AreWhereTwoScansShowThemAndForSomeSeconds) {
  Movers movers;
  movers.Add(1.0, {{2.0, 0.0}});
  EXPECT_EQ(movers.Nearest(1.0, {0.0, 0.0}), static_cast<double>(kInf)) << "a phantom";
  movers.Add(1.1, {{1.95, 0.1}});
  EXPECT_NEAR(movers.Nearest(1.1, {0.0, 0.0}), std::hypot(1.95, 0.1), 1e-9);
  movers.Add(1.2, {{1.85, 0.2}});
  EXPECT_NEAR(movers.Nearest(1.2, {0.0, 0.0}), std::hypot(1.85, 0.2), 1e-9) << "one person";
  movers.Add(1.3, {});
  EXPECT_LT(movers.Nearest(5.0, {0.0, 0.0}), 2.0) << "out of sight, and still about";
  EXPECT_EQ(movers.Nearest(5.3, {0.0, 0.0}), static_cast<double>(kInf));
}

TEST(SurroundingsMovers, WhoStepsOntoFloorThatWasJustSeenIsOneAndAWallIsNot) {
  ManualClock clock;
  const RobotOptions robot;
  Surroundings surroundings(robot);
  const auto feed = [&](float range, bool is_hit) {
    clock.Advance(std::chrono::milliseconds(100));
    surroundings.SetScan(FlatScan(clock.Now().utime, range, is_hit), {});
    surroundings.Update(clock.Now(), {});
  };
  for (int i = 0; i < 10; ++i) feed(1.5F, true);
  EXPECT_EQ(surroundings.NearestMover({0.0, 0.0}), static_cast<double>(kInf));
  feed(1.0F, true);
  feed(0.95F, true);
  EXPECT_NEAR(surroundings.NearestMover({0.0, 0.0}), 1.1, 0.1);
}

TEST(SurroundingsArc, ShorterThanAStepIsLookedAlongToo) {
  ManualClock clock;
  const RobotOptions robot;
  Surroundings surroundings(robot);
  clock.Advance(std::chrono::milliseconds(100));
  surroundings.SetScan(
      FlatScan(clock.Now().utime, static_cast<float>(robot.radius_m) + 0.03F, true), {});
  surroundings.Update(clock.Now(), {});
  // What is met some 3 cm ahead is within a margin of 5 cm after any step.
  EXPECT_LT(LookAlong(surroundings, robot, {}, 0.0, 1, 0.02, 0.05).free_m, 0.02);
}

TEST_F(SafetyMonitorTest, OpenFloorThatLooksTheSameIsNotFrozen) {
  Pose2 pose;
  for (int i = 0; i < 60; ++i) {
    clock_.Advance(std::chrono::milliseconds(50));
    pose.x += 0.025;
    monitor_.OnScan(clock_.Now(), FlatScan(clock_.Now().utime, 5.0F, false), pose);
    monitor_.OnPose(clock_.Now(), clock_.Now().utime, {});
  }
  EXPECT_EQ(monitor_.Blocker(clock_.Now()), stop_reason::kNone);
  // A wall that stays at the same distance while the robot drives towards it is.
  for (int i = 0; i < 60; ++i) {
    clock_.Advance(std::chrono::milliseconds(50));
    pose.x += 0.025;
    monitor_.OnScan(clock_.Now(), FlatScan(clock_.Now().utime, 2.0F, true), pose);
    monitor_.OnPose(clock_.Now(), clock_.Now().utime, {});
  }
  EXPECT_EQ(monitor_.Blocker(clock_.Now()), stop_reason::kScanFrozen);
}

// ---- LocalFrame

TEST(LocalFrame, FollowsCommandsWhereThereIsNoOdometry) {
  RobotOptions robot;
  robot.centre_x_m = -0.15;
  LocalFrame frame(robot);
  ManualClock clock;
  for (int i = 0; i <= 40; ++i) {
    frame.AddCommand(clock.Now(), {0.0, 0.5});
    if (i < 40) clock.Advance(std::chrono::milliseconds(50));
  }
  // Turned by one radian about the disc's centre, which stays where it was.
  const Pose2 pose = frame.Now(clock.Now());
  EXPECT_NEAR(pose.theta, 1.0, 1e-6);
  const Eigen::Vector2d centre = pose * Eigen::Vector2d(-0.15, 0.0);
  EXPECT_NEAR(centre.x(), -0.15, 1e-6);
  EXPECT_NEAR(centre.y(), 0.0, 1e-6);
}

TEST(LocalFrame, OdometryThatStartsAnewIsAnotherFrame) {
  LocalFrame frame(RobotOptions{});
  ManualClock clock;
  EXPECT_TRUE(frame.AddOdometry(clock.Now(), clock.Now().utime, {5.0, 1.0, 0.0}));
  clock.Advance(std::chrono::milliseconds(50));
  EXPECT_TRUE(frame.AddOdometry(clock.Now(), clock.Now().utime, {5.02, 1.0, 0.0}));
  clock.Advance(std::chrono::milliseconds(50));
  EXPECT_FALSE(frame.AddOdometry(clock.Now(), clock.Now().utime, {0.0, 0.0, 0.0}));
  EXPECT_NEAR(frame.Now(clock.Now()).x, 0.0, 1e-9);
}

TEST(LocalFrame, ABaseRestartedWithinHalfAMetreOfItsOriginIsNoticed) {
  const RobotOptions robot{.max_speed_mps = 0.5, .max_turn_radps = 1.2};
  ManualClock clock;
  LocalFrame quick(robot);
  EXPECT_TRUE(quick.AddOdometry(clock.Now(), clock.Now().utime, {0.4, 0.1, 0.5}));
  LocalFrame slow = quick;
  clock.Advance(std::chrono::milliseconds(100));
  EXPECT_FALSE(quick.AddOdometry(clock.Now(), clock.Now().utime, {0.01, 0.0, 0.001}));
  clock.Advance(std::chrono::seconds(4));
  EXPECT_FALSE(slow.AddOdometry(clock.Now(), clock.Now().utime, {0.0, 0.0, 0.0}));
}

// ---- Destination

TEST(Destination, GoesNearerWhereTheRadioIsUncertain) {
  const RoutePlanner planner(Room(10.0, 6.0), {}, {});
  Destination destination{ArrivalOptions{}};
  destination.Set({Call::Kind::kTag, 0, "t", Eigen::Vector2d::Zero()});
  EXPECT_EQ(destination.Doubt({}), stop_reason::kLocationMissing);
  LocatedTag location{0, "t", true, {5.0, 3.0}, 0.1 * Eigen::Matrix2d::Identity(), 1.0};
  destination.OnLocation({}, location);
  EXPECT_EQ(destination.Doubt({}), stop_reason::kNone);
  EXPECT_TRUE(destination.HasArrived({5.9, 3.0}, false, planner));
  location.area_90_m2 = 9.0;
  destination.OnLocation({}, location);
  EXPECT_FALSE(destination.HasArrived({5.9, 3.0}, false, planner));
  // But where something is in the way, that will do.
  EXPECT_TRUE(destination.HasArrived({5.9, 3.0}, true, planner));
  EXPECT_FALSE(destination.HasArrived({7.2, 3.0}, true, planner));
  Instant later;
  later.steady = std::chrono::seconds(11);
  EXPECT_EQ(destination.Doubt(later), stop_reason::kLocationStale);
}

// ---- ResumeFile

TEST(ResumeFile, KeepsACallForAWhile) {
  const testing::TempDir folder;
  const auto path = folder.path() / "call";
  ResumeFile file(path, 10.0);
  EXPECT_FALSE(file.Load(0));
  file.Save(1'000'000, Call{Call::Kind::kTag, 7, "tag with spaces", Eigen::Vector2d::Zero()});
  const auto tag = file.Load(5'000'000);
  ASSERT_TRUE(tag);
  EXPECT_EQ(tag->tag, "tag with spaces");
  EXPECT_EQ(tag->kind, Call::Kind::kTag);
  EXPECT_EQ(tag->utime, 7);
  EXPECT_FALSE(file.Load(12'000'000)) << "too old";
  file.Save(20'000'000, Call{Call::Kind::kPoint, 8, "", {1.25, -3.5}});
  ASSERT_TRUE(file.Load(20'000'000));
  EXPECT_EQ(file.Load(20'000'000)->point, Eigen::Vector2d(1.25, -3.5));
  std::ofstream(path) << "beckon-call-1 20000000 8 point 1.2";
  EXPECT_FALSE(file.Load(20'000'000)) << "cut short";
  file.Save(20'000'000, std::nullopt);
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace beckon
