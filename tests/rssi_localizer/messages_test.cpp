#include "services/rssi_localizer/messages.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "common/pose_message.hpp"

namespace beckon {
namespace {

TagLocation EvenlyOver(const FloorGrid& grid) {
  TagLocation location;
  location.tag = "tag";
  location.utime = 5;
  location.posterior.elsewhere = 1.0F / static_cast<float>(grid.size());
  location.estimate = Summarise(grid, location.posterior);
  return location;
}

FloorPlan Plan(double width, double height) {
  FloorPlan plan;
  plan.max = {width, height};
  return plan;
}

TEST(LocationMap, FitsOneDatagramHoweverLargeTheFloor) {
  const FloorGrid grid(Plan(300.0, 200.0), {.resolution_m = 0.25, .max_cells = 1'000'000});
  const probability_map_t map = MapFromLocation(grid, EvenlyOver(grid));
  EXPECT_LT(map.getEncodedSize(), 60'000);
  EXPECT_EQ(map.size, map.width * map.height);
  EXPECT_EQ(map.credible_level.size(), static_cast<std::size_t>(map.size));
  EXPECT_GE(map.width * map.resolution_m, 300.0);
  EXPECT_GE(map.height * map.resolution_m, 200.0);
}

TEST(LocationMap, LevelsBelow230AreTheNinetyPercentArea) {
  FloorPlan plan = Plan(10.0, 10.0);
  plan.obstacles = {{{0.0, 0.0}, {1.0, 0.0}, {1.0, 10.0}, {0.0, 10.0}}};
  const FloorGrid grid(plan, {.resolution_m = 0.25});
  TagLocation location = EvenlyOver(grid);
  CellValues probability;
  for (const Eigen::Vector2d& centre : grid.centres()) {
    probability.push_back(static_cast<float>(-(centre - Eigen::Vector2d(6.0, 5.0)).squaredNorm()));
  }
  NormaliseLog(probability);
  location.posterior = SparsePosterior::From(std::move(probability));
  location.estimate = Summarise(grid, location.posterior);
  const probability_map_t map = MapFromLocation(grid, location);
  int walkable = 0;
  int inside = 0;
  for (const std::uint8_t level : map.credible_level) {
    walkable += level != 255 ? 1 : 0;
    inside += level < 230 ? 1 : 0;
  }
  EXPECT_EQ(walkable, grid.size());
  EXPECT_NEAR(inside * 0.25 * 0.25, location.estimate.area_90_m2, 0.1);
  // Rows run upwards: the likeliest cell is where the mean is.
  const int index = grid.geometry().IndexAt({6.0, 5.0});
  EXPECT_LT(map.credible_level[static_cast<std::size_t>(index)], 10);
}

TEST(LocationMessage, CarriesTheEstimate) {
  const FloorGrid grid(Plan(6.0, 4.0), {.resolution_m = 0.1});
  TagLocation location = EvenlyOver(grid);
  location.status = TagLocation::Status::kSilent;
  location.beacons = 3;
  location.readings = 7;
  const location_t message = MessageFromLocation(location);
  EXPECT_EQ(message.utime, 5);
  EXPECT_EQ(message.tag, "tag");
  EXPECT_EQ(message.status, location_t::SILENT);
  EXPECT_NEAR(message.position[0], 3.0, 1e-3);
  EXPECT_NEAR(message.position[1], 2.0, 1e-3);
  EXPECT_NEAR(message.covariance[0], 3.0, 0.01);
  EXPECT_NEAR(message.covariance[3], 4.0 / 3.0, 0.01);
  EXPECT_EQ(message.covariance[1], message.covariance[2]);
  EXPECT_EQ(message.beacons, 3);
  EXPECT_EQ(message.readings, 7);
}

TEST(RobotPose, MovesAsOdometrySays) {
  const bot_core::pose_t odometry = MessageFromPose(7, {2.0, 0.0, 0.5}, 0.4, -0.3);
  const bot_core::pose_t pose = RobotPoseMessage({1.0, 4.0, 2.0}, odometry);
  EXPECT_EQ(pose.utime, 7);
  EXPECT_NEAR(pose.pos[0], 1.0, 1e-9);
  EXPECT_NEAR(pose.pos[1], 4.0, 1e-9);
  EXPECT_NEAR(PoseFromMessage(pose).theta, 2.0, 1e-9);
  EXPECT_NEAR(pose.vel[0], 0.4 * std::cos(2.0), 1e-9);
  EXPECT_NEAR(pose.vel[1], 0.4 * std::sin(2.0), 1e-9);
  EXPECT_NEAR(pose.rotation_rate[2], -0.3, 1e-9);
}

TEST(RobotPose, MovesAsTheGroundSays) {
  planar_motion_t motion{};
  motion.utime_from = 1'000'000;
  motion.utime = 1'100'000;
  motion.translation[0] = 0.05;
  motion.rotation_rad = -0.02;
  const bot_core::pose_t pose = RobotPoseMessage({1.0, 4.0, std::numbers::pi / 2.0}, motion);
  EXPECT_EQ(pose.utime, 1'100'000);
  EXPECT_NEAR(pose.vel[1], 0.5, 1e-9);
  EXPECT_NEAR(pose.rotation_rate[2], -0.2, 1e-9);
}

TEST(Odometry, NonsenseIsRefused) {
  bot_core::pose_t odometry = MessageFromPose(7, {2.0, 0.0, 0.5}, 0.4, -0.3);
  EXPECT_NEAR(OdometryFromMessage(odometry).theta, 0.5, 1e-9);
  odometry.pos[0] = std::nan("");
  EXPECT_THROW(OdometryFromMessage(odometry), std::invalid_argument);
  EXPECT_THROW(OdometryFromMessage(bot_core::pose_t{}), std::invalid_argument)
      << "a zero quaternion is no rotation";
}

TEST(GroundMotion, CountsOnlyWhereItIsKnownAndFinite) {
  planar_motion_t message{};
  message.translation[0] = 0.5;
  EXPECT_EQ(MotionFromMessage(message)->x, 0.5);
  message.translation[0] = std::nan("");
  EXPECT_THROW(MotionFromMessage(message), std::invalid_argument);
  message.status = planar_motion_t::INCONSISTENT;
  EXPECT_FALSE(MotionFromMessage(message));
}

}  // namespace
}  // namespace beckon
