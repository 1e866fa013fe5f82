// A fingerprint is a promise to every program that speaks Beckon's messages, in any language, and
// to every log that was ever recorded. Whoever changes a message changes a number here, and knows
// it.
#include <gmock/gmock.h>

#include "beckon/call_t.hpp"
#include "beckon/ground_t.hpp"
#include "beckon/location_t.hpp"
#include "beckon/navigator_status_t.hpp"
#include "beckon/occupancy_grid_t.hpp"
#include "beckon/planar_motion_t.hpp"
#include "beckon/probability_map_t.hpp"
#include "beckon/rssi_reading_t.hpp"
#include "beckon/service_health_t.hpp"
#include "beckon/velocity_command_t.hpp"
#include "bot_core/image_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "bot_core/pose_t.hpp"
#include "common/message_bus.hpp"

namespace beckon {
namespace {

template <typename T>
std::uint64_t Fingerprint() {
  return static_cast<std::uint64_t>(T::getHash());
}

TEST(Fingerprints, OfLibbotsTypesAreLibbots) {
  EXPECT_EQ(Fingerprint<bot_core::image_t>(), 0x14739ffe13d5f5f0U);
  EXPECT_EQ(Fingerprint<bot_core::planar_lidar_t>(), 0xe3d17423180b5e8dU);
  EXPECT_EQ(Fingerprint<bot_core::pose_t>(), 0x2e16efb052b0105eU);
  EXPECT_EQ(static_cast<int>(bot_core::image_t::PIXEL_FORMAT_MJPEG), 1196444237);
}

TEST(Fingerprints, OfBeckonsTypesAreAsReleased) {
  EXPECT_EQ(Fingerprint<call_t>(), 0xf887ecf308840581U);
  EXPECT_EQ(Fingerprint<ground_t>(), 0xad7d35f3d5c5278eU);
  EXPECT_EQ(Fingerprint<location_t>(), 0xf9c67cd041dc532fU);
  EXPECT_EQ(Fingerprint<navigator_status_t>(), 0x2660bf5f8629a67aU);
  EXPECT_EQ(Fingerprint<occupancy_grid_t>(), 0x9f2d301e7f995090U);
  EXPECT_EQ(Fingerprint<planar_motion_t>(), 0x610b7a6b50253786U);
  EXPECT_EQ(Fingerprint<probability_map_t>(), 0x3a9f1361d3b53672U);
  EXPECT_EQ(Fingerprint<rssi_reading_t>(), 0xdbe79631728f15c7U);
  EXPECT_EQ(Fingerprint<service_health_t>(), 0x3b67bac67d7c9b77U);
  EXPECT_EQ(Fingerprint<velocity_command_t>(), 0xc6632d5ba30711bbU);
}

class DecodeExactlyTest : public ::testing::Test {
 protected:
  DecodeExactlyTest() {
    bot_core::planar_lidar_t scan{};
    scan.utime = 42;
    scan.ranges = {1.0F, 2.0F, 3.0F};
    scan.nranges = 3;
    bytes_.resize(static_cast<std::size_t>(scan.getEncodedSize()));
    scan.encode(bytes_.data(), 0, static_cast<int>(bytes_.size()));
  }
  bool Accepted() const {
    bot_core::planar_lidar_t scan{};
    return DecodeExactly(bytes_.data(), bytes_.size(), scan);
  }
  // The count of ranges follows the fingerprint and utime, big-endian.
  void SetCount(std::uint32_t count) {
    for (std::size_t i = 0; i < 4; ++i)
      bytes_[16 + i] = static_cast<std::uint8_t>(count >> (24 - 8 * i));
  }
  std::vector<std::uint8_t> bytes_;
};

TEST_F(DecodeExactlyTest, WellFormed) { EXPECT_TRUE(Accepted()); }

TEST_F(DecodeExactlyTest, NegativeCount) {
  SetCount(0xFFFFFFFFU);
  EXPECT_FALSE(Accepted());
}

TEST_F(DecodeExactlyTest, CountBeyondTheMessage) {
  SetCount(4);
  EXPECT_FALSE(Accepted());
}

TEST_F(DecodeExactlyTest, BytesLeftOver) {
  bytes_.push_back(0);
  EXPECT_FALSE(Accepted());
}

TEST_F(DecodeExactlyTest, EveryTruncation) {
  while (!bytes_.empty()) {
    bytes_.pop_back();
    EXPECT_FALSE(Accepted()) << bytes_.size();
  }
}

TEST_F(DecodeExactlyTest, AnotherFingerprint) {
  bytes_[3] ^= 1;
  EXPECT_FALSE(Accepted());
}

}  // namespace
}  // namespace beckon
