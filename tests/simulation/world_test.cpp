#include "tools/simulation/world.hpp"

#include <gmock/gmock.h>

#include "common/csv.hpp"
#include "tests/support/support.hpp"
#include "tools/simulation/folders.hpp"
#include "tools/simulation/route.hpp"

namespace beckon::simulation {
namespace {

using ::testing::Ge;
using ::testing::IsEmpty;
using ::testing::Le;
using ::testing::Not;

Eigen::Vector2d FootprintCentre(const World& world, const WorldOptions& options) {
  return world.map_from_robot * Eigen::Vector2d(options.robot_centre_x_m, 0.0);
}

std::size_t RoomOf(const World& world, const Eigen::Vector2d& point) {
  std::size_t room = 0;
  while (room < world.rooms.size() && !world.rooms[room].Contains(point)) ++room;
  return room;
}

TEST(World, HasAWayForTheRobotToTheCallerInAnotherRoomForEverySeed) {
  const WorldOptions options;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    const World world = MakeWorld(seed, options);
    const Eigen::Vector2d start = FootprintCentre(world, options);
    EXPECT_NE(RoomOf(world, start), RoomOf(world, world.caller));
    for (const Solid& solid : world.solids) {
      EXPECT_GT(Distance(solid, start), options.robot_radius_m + 0.2) << solid.name;
    }
    // As near as the caller's body and both clearances let it.
    const double reach_m = kPersonRadiusM + options.robot_radius_m + 0.4;
    EXPECT_THAT(ShortestWay(MakeClearanceMap(world), start, world.caller, reach_m,
                            options.robot_radius_m + options.margin_m),
                Not(IsEmpty()));
  }
}

TEST(World, KeepsToItsOptions) {
  WorldOptions options;
  options.min_rooms = 3;
  options.max_rooms = 3;
  options.min_furniture = 2;
  options.max_furniture = 4;
  options.walking_people = 2;
  int with_people = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const World world = MakeWorld(seed, options);
    EXPECT_EQ(world.rooms.size(), 3U);
    EXPECT_EQ(world.doors.size(), 2U);
    for (const Door& door : world.doors) {
      EXPECT_THAT(door.width_m, ::testing::AllOf(Ge(0.8), Le(1.0)));
      for (const Solid& solid : world.solids) {
        EXPECT_GE(Distance(solid, door.centre), 0.5 * door.width_m - 1e-9) << solid.name;
      }
    }
    const auto furniture =
        std::count_if(world.solids.begin(), world.solids.end(),
                      [](const Solid& solid) { return solid.kind == SolidKind::kFurniture; });
    EXPECT_LE(furniture, 4);
    EXPECT_GE(world.beacons.size(), 4U);
    with_people += world.people.size() == 2;
  }
  EXPECT_GE(with_people, 18);
}

TEST(World, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const World once = MakeWorld(7, {});
  const World again = MakeWorld(7, {});
  const World other = MakeWorld(8, {});
  ASSERT_EQ(once.solids.size(), again.solids.size());
  for (std::size_t i = 0; i < once.solids.size(); ++i) {
    EXPECT_EQ(once.solids[i].centre, again.solids[i].centre);
    EXPECT_EQ(once.solids[i].height_m, again.solids[i].height_m);
  }
  EXPECT_EQ(once.caller, again.caller);
  EXPECT_NE(once.caller, other.caller);
}

TEST(World, PeopleWalkOnlyWhereTheyFit) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const World world = MakeWorld(seed, {});
    for (const WalkingPerson& person : world.people) {
      for (std::size_t i = 1; i < person.waypoints.size(); ++i) {
        for (double t = 0.0; t <= 1.0; t += 0.05) {
          const Eigen::Vector2d point =
              (1.0 - t) * person.waypoints[i - 1] + t * person.waypoints[i];
          for (const Solid& solid : world.solids)
            EXPECT_GT(Distance(solid, point), kPersonRadiusM) << solid.name;
        }
      }
    }
  }
}

TEST(Site, LoadsAsTheServicesLoadItAndHidesTheFurniture) {
  const beckon::testing::TempDir folder;
  const World world = MakeWorld(3, {});
  WriteSite(folder.path(), world, {});
  const Site site = Site::Load(folder.path());
  EXPECT_EQ(site.beacons.size(), world.beacons.size());
  EXPECT_EQ(site.plan.walls.size(), world.inner_walls.size());
  for (const Solid& solid : world.solids) {
    const bool inside = (solid.centre.array() > world.min.array()).all() &&
                        (solid.centre.array() < world.max.array()).all();
    if (!inside) continue;
    EXPECT_EQ(site.plan.IsFree(solid.centre), solid.kind != SolidKind::kWall) << solid.name;
  }
  for (const Door& door : world.doors) EXPECT_TRUE(site.plan.IsFree(door.centre));

  const auto calibration = LoadCalibration(folder.path() / "calibration.csv", site);
  EXPECT_GT(calibration.size(), 100 * site.beacons.size() / 2);
  const auto readings = LoadReadings(folder.path() / "readings.csv", site);
  const auto truth = LoadTruth(folder.path() / "truth.csv");
  ASSERT_EQ(truth.size(), 60U);
  // Each epoch has readings within the site's window, and none of its neighbour's.
  for (const TruthEpoch& epoch : truth) {
    const auto in_window =
        std::count_if(readings.begin(), readings.end(), [&](const Reading& reading) {
          return reading.utime <= epoch.utime &&
                 reading.utime > epoch.utime - UtimeFromSeconds(site.window_s);
        });
    EXPECT_GT(in_window, 8);
    EXPECT_LE(in_window, 8 * static_cast<std::ptrdiff_t>(site.beacons.size()));
  }
}

TEST(Site, AFolderThatCannotBeWrittenIsAnError) {
  const beckon::testing::TempDir folder;
  const auto file = folder.Write("taken", "");
  EXPECT_THROW(WriteSite(file / "site", MakeWorld(1, {}), {}), std::exception);
}

TEST(Route, GoesStraightWhereNothingStandsInTheWay) {
  World world;
  world.min = {0.0, 0.0};
  world.max = {6.0, 4.0};
  const ClearanceMap open = MakeClearanceMap(world);
  EXPECT_NEAR(LengthOf(ShortestWay(open, {1.0, 1.0}, {5.0, 2.0}, 0.1, 0.3)), std::sqrt(17.0) - 0.1,
              0.1);

  // Round the end of a wall: two straight lines that pass its corner at the radius.
  world.solids.push_back(MakeBox("wall", SolidKind::kWall, {3.0, 1.0, 0.0}, {0.1, 2.0}, 2.0));
  const ClearanceMap walled = MakeClearanceMap(world);
  const double round_corner = 2.0 * std::hypot(2.0, 1.3);
  EXPECT_NEAR(LengthOf(ShortestWay(walled, {1.0, 1.0}, {5.0, 1.0}, 0.1, 0.3)), round_corner, 0.2);

  world.solids.push_back(MakeBox("rest", SolidKind::kWall, {3.0, 3.0, 0.0}, {0.1, 2.0}, 2.0));
  EXPECT_THAT(ShortestWay(MakeClearanceMap(world), {1.0, 1.0}, {5.0, 1.0}, 0.1, 0.3), IsEmpty());
}

}  // namespace
}  // namespace beckon::simulation
