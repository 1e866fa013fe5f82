// The line protocol and what base_adapter makes of it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "tools/base_adapter/adapter.hpp"

namespace beckon {
namespace {

std::vector<Pose2> Push(OdometryReader& reader, const std::string& text) {
  return reader.Push({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(LineProtocol, ChecksumIsTheExclusiveOrOfTheBody) {
  EXPECT_EQ(ChecksummedLine("A"), "A*41\n");
  EXPECT_EQ(ChecksummedLine("AA"), "AA*00\n");
  EXPECT_EQ(VelocityLine(0.25, -0.1), ChecksummedLine("V 0.2500 -0.1000"));
}

TEST(OdometryReader, PutsLinesTogetherWhereverTheyAreCut) {
  const std::string text = "\n" + ChecksummedLine("O 1.5 -2.25 0.5") + "# battery 12.1\n" +
                           ChecksummedLine("O 1e-3 0 -7");
  for (std::size_t cut = 1; cut < text.size(); ++cut) {
    OdometryReader reader;
    auto poses = Push(reader, text.substr(0, cut));
    const auto rest = Push(reader, text.substr(cut));
    poses.insert(poses.end(), rest.begin(), rest.end());
    ASSERT_EQ(poses.size(), 2U) << cut;
    EXPECT_EQ(poses[0].x, 1.5);
    EXPECT_EQ(poses[0].y, -2.25);
    EXPECT_EQ(poses[0].theta, 0.5);
    EXPECT_NEAR(poses[1].theta, -7.0 + 2.0 * std::numbers::pi, 1e-12);
    EXPECT_EQ(reader.counts().refused, 0);
  }
}

TEST(OdometryReader, RefusesWhatIsNotWhatWasSent) {
  const std::string good = ChecksummedLine("O 1 2 0.3");
  OdometryReader reader;
  Push(reader, "\n");
  // Every single bit that flips is noticed.
  std::int64_t refused = 0;
  for (std::size_t i = 0; i + 1 < good.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string bad = good;
      bad[i] = static_cast<char>(bad[i] ^ (1 << bit));
      if (bad[i] == '\n' || bad[i] == '#') continue;
      // A checksum in small letters is the same number.
      if (i >= good.size() - 3 && std::tolower(bad[i]) == std::tolower(good[i])) continue;
      EXPECT_TRUE(Push(reader, bad).empty()) << bad;
      ++refused;
    }
  }
  EXPECT_EQ(reader.counts().refused, refused);
  for (const char* body : {"O 1 2", "O 1 2 3 4", "O 1 2 nan", "O 1 2 inf", "O 1 2 x", "P 1 2 3",
                           "O  1 2 3", "O 1 2 3 ", ""}) {
    EXPECT_TRUE(Push(reader, ChecksummedLine(body)).empty()) << body;
  }
  EXPECT_TRUE(Push(reader, "O 1 2 3\nO 1 2 3*\nO 1 2 3*4\n").empty());
  EXPECT_TRUE(Push(reader, std::string(5000, 'x') + "\n").empty());
  EXPECT_EQ(reader.counts().refused, refused + 9 + 3 + 1);
  EXPECT_EQ(Push(reader, good).size(), 1U) << "and goes on";
}

TEST(OdometryReader, WhatWasBegunBeforeARestartIsLeftOut) {
  OdometryReader reader;
  EXPECT_TRUE(Push(reader, ".3*00\n").empty()) << "the end of a line";
  EXPECT_EQ(reader.counts().refused, 0);
  Push(reader, "O 1 2");
  reader.Restart();
  EXPECT_TRUE(Push(reader, " 0.3*2C\n").empty());
  EXPECT_EQ(Push(reader, ChecksummedLine("O 1 2 0.3")).size(), 1U);
}

TEST(CommandKeeper, ACommandHoldsForItsTimeOnBothClocks) {
  BaseAdapterOptions options;
  options.robot.max_speed_mps = 0.5;
  options.robot.max_turn_radps = 1.0;
  CommandKeeper keeper(options);
  ManualClock clock;
  EXPECT_EQ(keeper.At(clock.Now()).linear_mps, 0.0);
  keeper.Set(clock.Now(), clock.Now().utime, {0.4, -0.2});
  clock.Advance(std::chrono::milliseconds(290));
  EXPECT_EQ(keeper.At(clock.Now()).linear_mps, 0.4);
  EXPECT_EQ(keeper.At(clock.Now()).angular_radps, -0.2);
  clock.Advance(std::chrono::milliseconds(20));
  EXPECT_EQ(keeper.At(clock.Now()).linear_mps, 0.0);
  // Arrives now, but was given long ago, or will be.
  keeper.Set(clock.Now(), clock.Now().utime - 400'000, {0.4, 0.0});
  EXPECT_EQ(keeper.At(clock.Now()).linear_mps, 0.0);
  keeper.Set(clock.Now(), clock.Now().utime + 400'000, {0.4, 0.0});
  EXPECT_EQ(keeper.At(clock.Now()).linear_mps, 0.0);
  // The wall clock is set back: the steady one still ends it.
  keeper.Set(clock.Now(), clock.Now().utime, {0.4, 0.0});
  clock.StepWallClock(std::chrono::milliseconds(-250));
  clock.Advance(std::chrono::milliseconds(310));
  EXPECT_EQ(keeper.At(clock.Now()).linear_mps, 0.0);
}

TEST(CommandKeeper, KeepsTheLimitsAndStopsForNonsense) {
  CommandKeeper keeper{BaseAdapterOptions{}};
  const Instant now{1'000'000, {}};
  keeper.Set(now, now.utime, {9.0, -9.0});
  EXPECT_EQ(keeper.At(now).linear_mps, RobotOptions{}.max_speed_mps);
  EXPECT_EQ(keeper.At(now).angular_radps, -RobotOptions{}.max_turn_radps);
  EXPECT_THROW(keeper.Set(now, now.utime, {std::nan(""), 0.0}), std::invalid_argument);
  EXPECT_EQ(keeper.At(now).linear_mps, 0.0);
}

TEST(OdometryKeeper, TellsOfTheRobotFrameAndItsVelocity) {
  RobotOptions robot;
  robot.centre_x_m = -0.2;  // the axle is 20 cm behind the camera
  OdometryKeeper keeper(robot);
  ManualClock clock;
  const auto first = keeper.Add(clock.Now(), {1.0, 2.0, std::numbers::pi / 2});
  EXPECT_NEAR(first.odometry_from_robot.x, 1.0, 1e-12);
  EXPECT_NEAR(first.odometry_from_robot.y, 2.2, 1e-12);
  EXPECT_EQ(first.forward_mps, 0.0);
  clock.Advance(std::chrono::milliseconds(50));
  const auto second = keeper.Add(clock.Now(), {1.0, 2.02, std::numbers::pi / 2 + 0.01});
  EXPECT_NEAR(second.forward_mps, 0.4, 1e-9);
  EXPECT_NEAR(second.turn_radps, 0.2, 1e-9);
  // Two lines in one piece: no time has passed between them, and no velocity is made up.
  EXPECT_EQ(keeper.Add(clock.Now(), {1.0, 2.04, 1.6}).forward_mps, 0.0);
}

}  // namespace
}  // namespace beckon
