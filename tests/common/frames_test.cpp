#include "common/frames.hpp"

#include <gmock/gmock.h>

#include <random>

#include "common/grid.hpp"
#include "common/pose_history.hpp"
#include "common/pose_message.hpp"

namespace beckon {
namespace {

constexpr double kPi = std::numbers::pi;

void ExpectSamePose(const Pose2& a, const Pose2& b) {
  EXPECT_NEAR(a.x, b.x, 1e-12);
  EXPECT_NEAR(a.y, b.y, 1e-12);
  EXPECT_NEAR(WrapAngle(a.theta - b.theta), 0.0, 1e-12);
}

TEST(WrapAngle, IsHalfOpen) {
  EXPECT_DOUBLE_EQ(WrapAngle(kPi), kPi);
  EXPECT_DOUBLE_EQ(WrapAngle(-kPi), kPi);
  EXPECT_NEAR(WrapAngle(7.0 * kPi + 0.1), -kPi + 0.1, 1e-12);
  EXPECT_NEAR(WrapAngle(-0.5), -0.5, 1e-15);
}

TEST(Pose2, ForwardAndLeftAreWhatTheyAreCalled) {
  const Pose2 map_from_robot{1.0, 2.0, kPi / 2.0};  // looks along the map's y
  const Eigen::Vector2d ahead = map_from_robot * Eigen::Vector2d(3.0, 0.0);
  EXPECT_NEAR(ahead.x(), 1.0, 1e-12);
  EXPECT_NEAR(ahead.y(), 5.0, 1e-12);
  const Eigen::Vector2d left = map_from_robot * Eigen::Vector2d(0.0, 1.0);
  EXPECT_NEAR(left.x(), 0.0, 1e-12);
  EXPECT_NEAR(left.y(), 2.0, 1e-12);
}

TEST(Pose2, InverseAndCompositionAreAGroup) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-5.0, 5.0);
  for (int i = 0; i < 100; ++i) {
    const Pose2 a{uniform(random), uniform(random), uniform(random)};
    const Pose2 b{uniform(random), uniform(random), uniform(random)};
    const Pose2 c{uniform(random), uniform(random), uniform(random)};
    ExpectSamePose(a * a.Inverse(), Pose2{});
    ExpectSamePose((a * b) * c, a * (b * c));
    ExpectSamePose((a * b).Inverse(), b.Inverse() * a.Inverse());
  }
}

TEST(PoseMessage, KeepsThePose) {
  const Pose2 pose{1.5, -2.5, 2.9};
  const auto message = MessageFromPose(123, pose, 0.4, -0.2);
  ExpectSamePose(PoseFromMessage(message), pose);
  EXPECT_NEAR(message.vel[0], 0.4 * std::cos(2.9), 1e-12);
  EXPECT_TRUE(IsPlausible(message));
}

TEST(PoseMessage, NonsenseIsNotPlausible) {
  auto message = MessageFromPose(123, {0.0, 0.0, 0.0}, 0.0, 0.0);
  message.orientation[0] = 0.0;
  EXPECT_FALSE(IsPlausible(message));
  message = MessageFromPose(123, {std::nan(""), 0.0, 0.0}, 0.0, 0.0);
  EXPECT_FALSE(IsPlausible(message));
}

TEST(GridGeometry, CoversWithoutAnExtraCellFromRounding) {
  const auto grid = GridGeometry::Covering({0.0, 0.0}, {3.0, 2.05}, 0.1);
  EXPECT_EQ(grid.width, 30);
  EXPECT_EQ(grid.height, 21);
}

TEST(GridGeometry, CentresFindTheirOwnCell) {
  const auto grid = GridGeometry::Covering({-1.3, 0.7}, {2.0, 3.0}, 0.25);
  for (int i = 0; i < grid.size(); ++i) EXPECT_EQ(grid.IndexAt(grid.Centre(i)), i);
  EXPECT_EQ(grid.IndexAt({-1.31, 1.0}), -1);
  EXPECT_EQ(grid.IndexAt({0.0, 9.0}), -1);
}

TEST(GridGeometry, NonsenseIsRefused) {
  EXPECT_THROW(GridGeometry::Covering({0.0, 0.0}, {1.0, 1.0}, 0.0), std::invalid_argument);
  EXPECT_THROW(GridGeometry::Covering({0.0, 0.0}, {-1.0, 1.0}, 0.1), std::invalid_argument);
  EXPECT_THROW(GridGeometry::Covering({0.0, 0.0}, {1e9, 1.0}, 0.1), std::invalid_argument);
}

TEST(PoseHistory, GoesOnAtTheLastVelocity) {
  PoseHistory history;
  for (int i = 0; i < 5; ++i) history.Add(50'000 * i, {0.025 * i, 0.0, 0.0});
  EXPECT_NEAR(history.At(250'000, 0.1)->x, 0.125, 1e-9);
  EXPECT_FALSE(history.At(400'000, 0.1));
}

TEST(PoseHistory, TwoPosesThatArriveTogetherMakeNoVelocity) {
  PoseHistory history;
  history.Add(0, {0.0, 0.0, 0.0});
  history.Add(100'000, {0.025, 0.0, 0.0});
  history.Add(100'030, {0.050, 0.0, 0.0});
  EXPECT_NEAR(history.At(150'000, 0.1)->x, 0.075, 0.001);
  PoseHistory young;
  young.Add(0, {0.0, 0.0, 0.0});
  young.Add(30, {0.025, 0.0, 0.0});
  EXPECT_EQ(young.At(50'000, 0.1)->x, 0.025);
}

}  // namespace
}  // namespace beckon
