#include <gmock/gmock.h>

#include <limits>

#include "tools/simulation/scripted_drive.hpp"
#include "tools/simulation/simulation.hpp"

namespace beckon::simulation {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

BaseOptions ExactBase() {
  BaseOptions options;
  options.odometry_scale_sd = 0.0;
  options.odometry_turn_scale_sd = 0.0;
  options.odometry_drift_rad_per_m = 0.0;
  options.odometry_noise = 0.0;
  return options;
}

World EmptyRoom() {
  World world;
  world.seed = 5;
  world.min = {0.0, 0.0};
  world.max = {10.0, 10.0};
  world.rooms = {{world.min, world.max}};
  world.solids.push_back(
      MakeBox("east wall", SolidKind::kWall, {10.1, 5.0, 0.0}, {0.2, 12.0}, 2.6));
  world.caller = {1.0, 9.0};
  world.map_from_robot = {5.0, 5.0, 0.0};
  return world;
}

void Drive(Simulation& simulation, double linear, double angular, double seconds) {
  for (int i = 0; i < static_cast<int>(std::lround(seconds / kStepS)); ++i) {
    simulation.Command(linear, angular);
    simulation.Step();
  }
}

TEST(Base, GathersSpeedAtItsAccelerationUpToItsLimit) {
  const BaseOptions options = ExactBase();
  Simulation simulation(EmptyRoom(), options, {});
  Drive(simulation, 5.0, 0.0, 0.5);
  EXPECT_NEAR(simulation.truth().speed_mps, 0.5 * options.robot.max_acceleration_mps2, 1e-9);
  Drive(simulation, 5.0, 0.0, 2.0);
  EXPECT_DOUBLE_EQ(simulation.truth().speed_mps, options.robot.max_speed_mps);
}

TEST(Base, StopsByItselfWhenCommandsCease) {
  const BaseOptions options = ExactBase();
  Simulation simulation(EmptyRoom(), options, {});
  Drive(simulation, 0.4, 0.0, 1.5);
  const double driven = simulation.truth().driven_m;
  double time_s = 0.0;
  while (simulation.truth().speed_mps > 0.0 && time_s < 5.0) {
    simulation.Step();
    time_s += kStepS;
  }
  // Full speed up to the timeout, then braking.
  EXPECT_NEAR(time_s, options.command_timeout_s + 0.4 / options.robot.max_acceleration_mps2,
              2 * kStepS);
  EXPECT_NEAR(simulation.truth().driven_m - driven,
              0.4 * options.command_timeout_s + 0.08 / options.robot.max_acceleration_mps2, 0.02);
}

TEST(Base, TurnsTheFootprintOnTheSpotAndCarriesTheCameraRound) {
  Simulation simulation(EmptyRoom(), ExactBase(), {});
  const Eigen::Vector2d centre = simulation.base().CentreAt(simulation.truth().map_from_robot);
  Drive(simulation, 0.0, 1.0, 3.0);
  const Pose2 pose = simulation.truth().map_from_robot;
  EXPECT_GT(pose.theta, 2.0);
  EXPECT_LT((simulation.base().CentreAt(pose) - centre).norm(), 1e-9);
  EXPECT_NEAR((pose.translation() - centre).norm(), 0.15, 1e-9);
  EXPECT_NEAR(simulation.truth().driven_m, 0.0, 1e-9);
}

TEST(Base, DrivesACircleOfTheCommandedRadius) {
  Simulation simulation(EmptyRoom(), ExactBase(), {});
  Drive(simulation, 0.4, 0.5, 3.0);  // at speed
  const Pose2 robot_from_axle{-0.15, 0.0, 0.0};
  const Pose2 from = simulation.truth().map_from_robot * robot_from_axle;
  Drive(simulation, 0.4, 0.5, 2.0);
  const Pose2 moved = from.Inverse() * (simulation.truth().map_from_robot * robot_from_axle);
  const double radius = 0.4 / 0.5;
  EXPECT_NEAR(moved.theta, 1.0, 1e-9);
  EXPECT_NEAR(moved.x, radius * std::sin(1.0), 1e-3);
  EXPECT_NEAR(moved.y, radius * (1.0 - std::cos(1.0)), 1e-3);
}

TEST(Base, TakesNonsenseAsAStop) {
  Simulation simulation(EmptyRoom(), ExactBase(), {});
  Drive(simulation, 0.4, 0.0, 1.0);
  Drive(simulation, std::numeric_limits<double>::quiet_NaN(), 0.1, 1.0);
  EXPECT_DOUBLE_EQ(simulation.truth().speed_mps, 0.0);
  EXPECT_DOUBLE_EQ(simulation.truth().turn_radps, 0.0);
}

TEST(Odometry, IsTheTruthWithoutErrorsAndDriftsWithThem) {
  Simulation exact(EmptyRoom(), ExactBase(), {});
  Simulation drifting(EmptyRoom(), {}, {});
  for (Simulation* simulation : {&exact, &drifting}) {
    Drive(*simulation, 0.4, 0.3, 5.0);
    Drive(*simulation, 0.4, -0.3, 5.0);
  }
  const auto error = [](const Simulation& simulation) {
    return simulation.truth().map_from_robot.Inverse() * simulation.base().odometry_from_robot();
  };
  EXPECT_LT(error(exact).translation().norm(), 1e-9);
  EXPECT_LT(std::abs(error(exact).theta), 1e-9);
  const double drift_m = error(drifting).translation().norm();
  EXPECT_GT(drift_m, 0.002);
  EXPECT_LT(drift_m, 0.3);  // of 3.7 m
}

TEST(Collision, StopsTheRobotNamesTheThingAndLetsItBackOff) {
  World world = EmptyRoom();
  world.map_from_robot = {9.0, 5.0, 0.0};
  Simulation simulation(world, ExactBase(), {});
  Drive(simulation, 0.5, 0.0, 5.0);
  ASSERT_THAT(simulation.truth().collisions, SizeIs(1));
  const Collision& collision = simulation.truth().collisions.front();
  EXPECT_EQ(collision.with, "east wall");
  EXPECT_NEAR(collision.place.x(), 9.75, 0.02);  // a radius before the wall
  EXPECT_GT(collision.time_s, 1.0);
  EXPECT_LE(simulation.base().CentreAt(simulation.truth().map_from_robot).x(), 9.75);
  EXPECT_LT(simulation.truth().closest_m, 0.02);
  EXPECT_EQ(simulation.truth().closest_to, "east wall");

  Drive(simulation, -0.3, 0.0, 2.0);
  EXPECT_LT(simulation.truth().map_from_robot.x, 9.6);
  Drive(simulation, 0.5, 0.0, 3.0);
  EXPECT_THAT(simulation.truth().collisions, SizeIs(2));
}

TEST(Person, WalksToAndFroAndNeverIntoTheRobot) {
  World world = EmptyRoom();
  world.people.push_back(
      {{{2.0, 5.0}, {8.0, 5.0}, {8.0, 8.0}}, 0.8});  // straight through the robot
  Simulation simulation(world, ExactBase(), {});
  double farthest_x = 0.0;
  for (int i = 0; i < 3000; ++i) {
    simulation.Step();
    const Solid body = simulation.People().at(0);
    farthest_x = std::max(farthest_x, body.centre.x());
    ASSERT_GT(simulation.truth().nearest_m, 0.5);
  }
  EXPECT_GT(farthest_x, 3.5);
  EXPECT_LT(farthest_x, 5.0);
  EXPECT_THAT(simulation.truth().collisions, IsEmpty());

  // Out of the way, it gets to the end.
  world.map_from_robot = {5.0, 1.0, 0.0};
  Simulation free(world, ExactBase(), {});
  double highest_y = 0.0;
  for (int i = 0; i < 1000; ++i) {
    free.Step();
    highest_y = std::max(highest_y, free.People().at(0).centre.y());
  }
  EXPECT_NEAR(highest_y, 8.0, 0.02);
}

TEST(Simulation, IsTheSameRunForTheSameSeedAndCommands) {
  const World world = MakeWorld(11, {});
  Simulation once(world, {}, {});
  Simulation again(world, {}, {});
  ScriptedDrive drive(world);
  std::size_t packets = 0;
  for (int i = 0; i < 500; ++i) {
    const auto [linear, angular] = drive.Command(once);
    once.Command(linear, angular);
    again.Command(linear, angular);
    const auto heard = once.Step();
    const auto heard_again = again.Step();
    ASSERT_EQ(heard.size(), heard_again.size());
    for (std::size_t k = 0; k < heard.size(); ++k)
      ASSERT_EQ(heard[k].rssi_dbm, heard_again[k].rssi_dbm);
    packets += heard.size();
  }
  EXPECT_GT(packets, 100U);
  EXPECT_EQ(once.base().odometry_from_robot().x, again.base().odometry_from_robot().x);
  EXPECT_EQ(once.People().at(0).centre, again.People().at(0).centre);
  EXPECT_GT(once.truth().driven_m, 0.5);
}

TEST(ScriptedDrive, ComesToTheCallerWithoutTouchingAnything) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    const World world = MakeWorld(seed, {});
    Simulation simulation(world, {}, {});
    ScriptedDrive drive(world);
    double nearest_to_caller = 1e9;
    for (int i = 0; i < 6000; ++i) {
      const auto [linear, angular] = drive.Command(simulation);
      simulation.Command(linear, angular);
      simulation.Step();
      nearest_to_caller = std::min(nearest_to_caller, simulation.truth().to_caller_m);
    }
    EXPECT_LT(nearest_to_caller, 1.4);
    EXPECT_THAT(simulation.truth().collisions, IsEmpty());
  }
}

TEST(Solids, RaysAndDistancesFollowClosedForms) {
  const Solid cylinder = MakeCylinder("c", SolidKind::kFurniture, {3.0, 0.0}, 0.5, 1.0);
  const Solid box =
      MakeBox("b", SolidKind::kFurniture, {0.0, 4.0, 0.5 * std::numbers::pi}, {2.0, 1.0}, 1.0);
  const auto through = Cross(cylinder, {0.0, 0.0}, {1.0, 0.0});
  ASSERT_TRUE(through);
  EXPECT_DOUBLE_EQ(through->enter_m, 2.5);
  EXPECT_DOUBLE_EQ(through->leave_m, 3.5);
  EXPECT_FALSE(Cross(cylinder, {0.0, 0.6}, {1.0, 0.0}));
  EXPECT_FALSE(Cross(cylinder, {0.0, 0.0}, {-1.0, 0.0}));
  EXPECT_FALSE(Cross(cylinder, {3.0, 0.1}, {1.0, 0.0}));  // from inside

  // The box is turned: 1 m wide along x, 2 m along y.
  const auto into_box = Cross(box, {0.0, 0.0}, {0.0, 1.0});
  ASSERT_TRUE(into_box);
  EXPECT_NEAR(into_box->enter_m, 3.0, 1e-12);
  EXPECT_NEAR(into_box->leave_m, 5.0, 1e-12);
  EXPECT_FALSE(Cross(box, {0.51, 0.0}, {0.0, 1.0}));
  EXPECT_NEAR(Distance(box, {0.0, 0.0}), 3.0, 1e-12);
  EXPECT_NEAR(Distance(box, {2.5, 7.0}), std::hypot(2.0, 2.0), 1e-12);
  EXPECT_NEAR(Distance(box, {0.4, 4.0}), -0.1, 1e-12);
  EXPECT_NEAR(CastRay({cylinder, box}, {0.0, 0.0}, 0.0), 2.5, 1e-12);
  EXPECT_EQ(CastRay({cylinder, box}, {0.0, 0.0}, std::numbers::pi),
            std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace beckon::simulation
