#include "services/range_caster/grid_mapper.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "beckon/occupancy_grid_t.hpp"
#include "common/frames.hpp"
#include "services/range_caster/messages.hpp"

namespace beckon {
namespace {

constexpr double kScanPeriodS = 0.1;
constexpr double kSeenM = 6.0;

// A scan as the caster would make it of a world in which `range` says how far it is free along a
// bearing in the robot frame.
template <typename Range>
VirtualScan ScanOf(const RayCaster& caster, Range range) {
  VirtualScan scan;
  scan.first_bearing_rad = -0.5 * RadiansFromDegrees(0.5) * static_cast<double>(caster.rays() - 1);
  scan.bearing_step_rad = RadiansFromDegrees(0.5);
  for (std::size_t ray = 0; ray < caster.rays(); ++ray) {
    const double r = range(scan.Bearing(ray));
    const double nearest = caster.nearest_visible_m()[ray];
    const bool is_hit = r < kSeenM;
    scan.ranges_m.push_back(is_hit ? static_cast<float>(std::max(r, nearest))
                                   : std::numeric_limits<float>::infinity());
    scan.ground_seen_m.push_back(r <= nearest ? 0.0F : static_cast<float>(std::min(r, kSeenM)));
  }
  return scan;
}

class GridMapperTest : public ::testing::Test {
 protected:
  // Occupancy in percent at a point of the robot frame of the newest scan; -1 where nothing is
  // known.
  double PercentAt(const Eigen::Vector2d& point) const {
    const OccupancyMap& map = mapper_.map();
    const Eigen::Vector2d in_grid = map.grid_from_robot() * point;
    const int column = static_cast<int>(std::floor(in_grid.x() / map.resolution_m()));
    const int row = static_cast<int>(std::floor(in_grid.y() / map.resolution_m()));
    const auto cell = map.Occupancy()[static_cast<std::size_t>(row * map.cells() + column)];
    return cell == 255 ? -1.0 : cell / 2.0;
  }

  // The robot stands at `pose` when it sees a wall x = `wall_x` of the odometry frame.
  void SeeWall(const Pose2& pose, double wall_x, double period_s = kScanPeriodS) {
    utime_ += UtimeFromSeconds(period_s);
    mapper_.motion().AddOdometry(utime_, pose);
    mapper_.AddScan(utime_, ScanOf(caster_, [&](double bearing) {
                      const double c = std::cos(pose.theta + bearing);
                      return c > 0.0 ? (wall_x - pose.x) / c : 1e9;
                    }));
    mapper_.Update();
  }

  const RayCaster caster_{GroundCamera::Pinhole(640, 480, 532.0, 0.55, RadiansFromDegrees(26.0)),
                          {}};
  GridMapper mapper_{caster_, OccupancyMapOptions{}};
  Utime utime_ = 1'700'000'000'000'000;
};

TEST_F(GridMapperTest, WallIsOccupiedFloorIsFreeTheRestIsUnknown) {
  for (int i = 0; i < 5; ++i) SeeWall({0.0, 0.0, 0.0}, 2.0);
  EXPECT_GT(PercentAt({2.02, 0.0}), 80.0);
  EXPECT_LT(PercentAt({1.5, 0.2}), 20.0);
  EXPECT_EQ(PercentAt({2.4, 0.0}), -1.0);
  EXPECT_EQ(PercentAt({-1.0, 0.0}), -1.0);
}

TEST_F(GridMapperTest, RemembersWhatLeftTheView) {
  for (int i = 0; i < 5; ++i) SeeWall({0.0, 0.0, 0.0}, 2.0);
  // Turns round on the spot, a quarter second per 15 degrees; the wall is then behind.
  for (int step = 1; step <= 12; ++step) SeeWall({0.0, 0.0, RadiansFromDegrees(15.0 * step)}, 2.0);
  EXPECT_GT(PercentAt({-2.02, 0.0}), 80.0);
  // Evidence fades: after many time constants nothing is known of it.
  for (int i = 0; i < 4000; ++i) SeeWall({0.0, 0.0, RadiansFromDegrees(180.0)}, 2.0);
  EXPECT_EQ(PercentAt({-2.02, 0.0}), -1.0);
}

TEST_F(GridMapperTest, MovesWithOdometryAcrossManyGridWidths) {
  // 10 m ahead at 0.5 m/s in a grid of 12 m: it has to be recentred on the way.
  for (int i = 0; i <= 200; ++i) SeeWall({0.05 * i, 0.0, 0.0}, 12.0);
  EXPECT_GT(PercentAt({2.02, 0.0}), 80.0);
  EXPECT_LT(PercentAt({1.0, 0.0}), 20.0);
  EXPECT_LT(PercentAt({-3.0, 0.0}), 50.0);  // driven through, still remembered
  EXPECT_GE(PercentAt({-3.0, 0.0}), 0.0);
}

TEST_F(GridMapperTest, OnePhantomDoesNotOverruleSeenGround) {
  for (int i = 0; i < 10; ++i) SeeWall({0.0, 0.0, 0.0}, 4.0);
  SeeWall({0.0, 0.0, 0.0}, 1.5);
  EXPECT_LT(PercentAt({1.52, 0.0}), 50.0);
  // Something that has really come stays, and is believed within half a second.
  for (int i = 0; i < 5; ++i) SeeWall({0.0, 0.0, 0.0}, 1.5);
  EXPECT_GT(PercentAt({1.52, 0.0}), 60.0);
  // It leaves again.
  for (int i = 0; i < 15; ++i) SeeWall({0.0, 0.0, 0.0}, 4.0);
  EXPECT_LT(PercentAt({1.52, 0.0}), 30.0);
}

// Errors of labels last for frames: thrice as many scans a second do not know thrice as much.
TEST_F(GridMapperTest, ItIsTimeThatCountsNotTheCamerasRate) {
  constexpr double kFastS = 1.0 / 30.0;
  for (int i = 0; i < 10; ++i) SeeWall({0.0, 0.0, 0.0}, 4.0);
  for (int i = 0; i < 6; ++i) SeeWall({0.0, 0.0, 0.0}, 1.5, kFastS);  // a phantom of 0.2 s
  EXPECT_LT(PercentAt({1.52, 0.0}), 50.0);
  for (int i = 0; i < 12; ++i) SeeWall({0.0, 0.0, 0.0}, 1.5, kFastS);
  EXPECT_GT(PercentAt({1.52, 0.0}), 60.0);
  // Scans that are rare say as much as others, each.
  for (int i = 0; i < 10; ++i) SeeWall({0.0, 0.0, 0.0}, 4.0, 0.2);
  EXPECT_LT(PercentAt({1.52, 0.0}), 30.0);
}

TEST_F(GridMapperTest, LowObstacleInTheBlindZoneIsNotForgotten) {
  for (int i = 0; i < 10; ++i) SeeWall({0.0, 0.0, 0.0}, 0.8);
  // The robot comes so near that the picture shows only the floor beyond the thing.
  for (int i = 1; i <= 5; ++i) SeeWall({0.1 * i, 0.0, 0.0}, 1e9);
  EXPECT_GT(PercentAt({0.32, 0.0}), 80.0);
}

TEST_F(GridMapperTest, WhatHidesTheNearestPixelsIsNotPutWhereTheyAre) {
  // It stands at 0.3 m: the camera only sees that it is nearer than the nearest visible ground.
  for (int i = 0; i < 3; ++i) SeeWall({0.0, 0.0, 0.0}, 0.3);
  const double nearest = caster_.nearest_visible_m()[caster_.rays() / 2];
  EXPECT_EQ(PercentAt({nearest + 0.02, 0.0}), -1.0);
}

TEST_F(GridMapperTest, GroundMotionServesWhereThereIsNoOdometry) {
  const auto see = [&](double x) {
    mapper_.AddScan(utime_, ScanOf(caster_, [&](double b) { return (3.0 - x) / std::cos(b); }));
    return mapper_.Update();
  };
  EXPECT_TRUE(see(0.0));
  for (int i = 1; i <= 10; ++i) {
    const Utime before = utime_;
    utime_ += UtimeFromSeconds(kScanPeriodS);
    // The scan arrives first, its motion later: it is waited for.
    EXPECT_FALSE(see(0.1 * i));
    mapper_.motion().AddGroundMotion(before, utime_, Pose2{0.1, 0.0, 0.0});
    EXPECT_TRUE(mapper_.Update());
  }
  EXPECT_GT(PercentAt({2.02, 0.0}), 80.0);
  EXPECT_NEAR(mapper_.map().grid_from_robot().x, 6.0 + 1.0, 1.0 / 16.0);
}

TEST_F(GridMapperTest, StartsAnewWhenTheMotionCannotBeKnown) {
  for (int i = 0; i < 5; ++i) SeeWall({0.0, 0.0, 0.0}, 2.0);
  const auto see_open_floor = [&] {
    utime_ += UtimeFromSeconds(kScanPeriodS);
    mapper_.AddScan(utime_, ScanOf(caster_, [](double) { return 1e9; }));
    mapper_.Update();
  };
  // Neither odometry nor ground motion from here on: the wall could be anywhere now.
  for (int i = 0; i < 6; ++i) see_open_floor();
  EXPECT_NE(mapper_.utime(), 0);
  EXPECT_LT(PercentAt({2.02, 0.0}), 50.0);
  EXPECT_EQ(PercentAt({2.02, 3.0}), -1.0);
}

TEST_F(GridMapperTest, OdometryThatJumpsIsNotBelieved) {
  for (int i = 0; i < 5; ++i) SeeWall({0.0, 0.0, 0.0}, 2.0);
  EXPECT_EQ(mapper_.motion().Between(utime_ - 100'000, utime_).has_value(), true);
  mapper_.motion().AddOdometry(utime_ + 50'000, {40.0, 7.0, 1.0});
  EXPECT_EQ(mapper_.motion().Between(utime_, utime_ + 50'000).has_value(), false);
}

TEST_F(GridMapperTest, TimeThatGoesBackStartsAnew) {
  for (int i = 0; i < 5; ++i) SeeWall({0.0, 0.0, 0.0}, 2.0);
  utime_ -= UtimeFromSeconds(100.0);
  SeeWall({0.0, 0.0, 0.0}, 1e9);
  EXPECT_EQ(mapper_.utime(), utime_);
  EXPECT_LT(PercentAt({2.02, 0.0}), 50.0);
}

TEST_F(GridMapperTest, MessageFitsOneDatagram) {
  SeeWall({0.0, 0.0, 0.0}, 2.0);
  const occupancy_grid_t message = MessageFromMap(utime_, mapper_.map());
  EXPECT_EQ(message.size, message.width * message.height);
  EXPECT_LT(message.getEncodedSize(), 60'000);
}

}  // namespace
}  // namespace beckon
