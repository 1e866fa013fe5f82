#include "tools/simulation/radio.hpp"

#include <gmock/gmock.h>

#include "tools/simulation/xbee_port.hpp"

namespace beckon::simulation {
namespace {

using ::testing::ElementsAre;

World OneBeacon() {
  World world;
  world.seed = 3;
  world.min = {0.0, 0.0};
  world.max = {40.0, 40.0};
  Beacon beacon;
  beacon.id = "0001";
  beacon.position = {0.0, 20.0, 1.0};
  world.beacons = {beacon};
  return world;
}

RadioOptions NoShadowing() {
  RadioOptions options;
  options.shadowing_sd_db = 0.0;
  options.beacon_offset_sd_db = 0.0;
  return options;
}

TEST(Radio, FallsWithTheLogarithmOfDistanceAndAtWalls) {
  World world = OneBeacon();
  const RadioOptions options = NoShadowing();
  const Radio radio(world, options);
  EXPECT_NEAR(radio.MeanPower(0, {1.0, 20.0}, 1.0), options.power_at_1m_dbm, 1e-9);
  EXPECT_NEAR(radio.MeanPower(0, {10.0, 20.0}, 1.0),
              options.power_at_1m_dbm - 10.0 * options.path_loss_exponent, 1e-9);
  Wall wall;
  wall.from = {5.0, 15.0};
  wall.to = {5.0, 25.0};
  world.inner_walls = {wall};
  const Radio behind_wall(world, options);
  EXPECT_NEAR(behind_wall.MeanPower(0, {10.0, 20.0}, 1.0),
              radio.MeanPower(0, {10.0, 20.0}, 1.0) - options.wall_loss_db, 1e-9);
  EXPECT_NEAR(behind_wall.MeanPower(0, {4.0, 20.0}, 1.0), radio.MeanPower(0, {4.0, 20.0}, 1.0),
              1e-9);
}

TEST(Radio, ShadowingHasItsSpreadAndItsCorrelationInSpace) {
  World world = OneBeacon();
  RadioOptions options = NoShadowing();
  options.shadowing_sd_db = 3.0;
  double sum_squared = 0.0;
  double sum_near = 0.0;
  double sum_far = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {  // a new field each
    world.seed = seed;
    const Radio radio(world, options);
    const Radio flat(world, NoShadowing());
    const auto shadowing = [&](const Eigen::Vector2d& point) {
      return radio.MeanPower(0, point, 1.0) - flat.MeanPower(0, point, 1.0);
    };
    for (double x = 2.0; x < 38.0; x += 3.0) {
      const double here = shadowing({x, 10.0});
      sum_squared += here * here;
      sum_near += here * shadowing({x, 10.0 + options.shadowing_length_m});
      sum_far += here * shadowing({x, 10.0 + 4.0 * options.shadowing_length_m});
      ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(sum_squared / count), 3.0, 0.3);
  EXPECT_NEAR(sum_near / sum_squared, std::exp(-0.5), 0.12);
  EXPECT_NEAR(sum_far / sum_squared, 0.0, 0.15);
}

TEST(Radio, FadesAndLosesPacketsAsItsModelSays) {
  const World world = OneBeacon();
  const RadioOptions options = NoShadowing();
  const Radio radio(world, options);
  const Eigen::Vector2d place(5.0, 20.0);
  double sum = 0.0;
  int received = 0;
  constexpr int kPackets = 20000;
  for (int i = 0; i < kPackets; ++i) {
    Random random(world.seed, Stream::kFading, static_cast<std::uint64_t>(i));
    if (const auto rssi = radio.Transmit(0, place, 1.0, random)) {
      sum += *rssi;
      ++received;
    }
  }
  // Mean of Rician fading in dB for K = 4: 10 lg(K / (K + 1)) + 10 / ln 10 E1(K), E1(4) = 0.003779.
  EXPECT_NEAR(sum / received, radio.MeanPower(0, place, 1.0) - 0.953, 0.1);
  EXPECT_NEAR(static_cast<double>(received) / kPackets, 1.0 - options.packet_loss, 0.01);

  // Far beyond its sensitivity nothing is heard.
  RadioOptions deaf = options;
  deaf.sensitivity_dbm = -40.0;
  const Radio deaf_radio(world, deaf);
  for (int i = 0; i < 200; ++i) {
    Random random(world.seed, Stream::kFading, static_cast<std::uint64_t>(i));
    EXPECT_FALSE(deaf_radio.Transmit(0, place, 1.0, random));
  }
}

TEST(Radio, BeaconsReportTheTagAndAreHeardAFewTimesASecond) {
  const World world = MakeWorld(2, {});
  Radio radio(world, {});
  std::map<std::string, int> packets;
  std::map<std::string, int> heard;
  for (std::uint64_t step = 0; step < 1000; ++step) {  // 20 s
    for (const RadioPacket& packet : radio.Step(step, 0.02, world.caller, world.caller)) {
      ++packets[packet.beacon];
      for (const HeardTag& tag : packet.heard) heard[packet.beacon] += tag.tag == kCallerTag;
    }
  }
  ASSERT_EQ(packets.size(), world.beacons.size());
  for (const auto& [beacon, count] : packets) {
    EXPECT_GT(count, 40) << beacon;
    EXPECT_LE(count, 80) << beacon;
    EXPECT_GT(heard[beacon], 30) << beacon;
  }
}

TEST(Xbee, FramesAreEscapedAndSummedUp) {
  // By hand: data 81 00 11 3F 00 "t -5\n"; the address byte 11 is escaped as 7D 31. Sum of the data
  // is 0x81 + 0x11 + 0x3F + 0x74 + 0x20 + 0x2D + 0x35 + 0x0A = 0x1D1; checksum FF - D1 = 2E.
  const RadioPacket packet{"0011", -63, {{"t", -5}}};
  EXPECT_THAT(XbeeBytes(packet), ElementsAre(0x7e, 0x00, 0x0a, 0x81, 0x00, 0x7d, 0x31, 0x3f, 0x00,
                                             't', ' ', '-', '5', '\n', 0x2e));
}

TEST(Xbee, PayloadsStayWithinAPacket) {
  RadioPacket packet{"0001", -50, {}};
  for (int i = 0; i < 50; ++i) packet.heard.push_back({"caller", -60});
  EXPECT_LT(XbeeBytes(packet).size(), 120U);
}

}  // namespace
}  // namespace beckon::simulation
