#include "services/beacon_reader/xbee_frames.hpp"

#include <gmock/gmock.h>

#include <random>

namespace beckon {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;

std::vector<Bytes> AllFrames(XbeeDeframer& deframer) {
  std::vector<Bytes> frames;
  while (auto frame = deframer.Next()) frames.push_back(*frame);
  return frames;
}

// Figure in Digi's user guide: the AT command frame of "NJ" with frame id 0x52.
const Bytes kManualFrame = {0x7e, 0x00, 0x04, 0x08, 0x52, 0x4e, 0x4a, 0x0d};
const Bytes kManualData = {0x08, 0x52, 0x4e, 0x4a};

// Digi's example of escaping: 0x7E 0x00 0x02 0x23 0x11 0xCB is sent with 0x11 as 0x7D 0x31.
const Bytes kEscapedFrame = {0x7e, 0x00, 0x02, 0x23, 0x7d, 0x31, 0xcb};
const Bytes kEscapedData = {0x23, 0x11};

TEST(XbeeFrames, AreWrittenAsInTheManual) {
  EXPECT_EQ(XbeeFrame(kManualData, XbeeApiMode::kPlain), kManualFrame);
  EXPECT_EQ(XbeeFrame(kEscapedData, XbeeApiMode::kEscaped), kEscapedFrame);
}

TEST(XbeeFrames, AreReadAsInTheManual) {
  XbeeDeframer plain(XbeeApiMode::kPlain);
  plain.Push(kManualFrame);
  EXPECT_THAT(AllFrames(plain), ElementsAre(kManualData));
  XbeeDeframer escaped(XbeeApiMode::kEscaped);
  escaped.Push(kEscapedFrame);
  EXPECT_THAT(AllFrames(escaped), ElementsAre(kEscapedData));
}

class BothModes : public ::testing::TestWithParam<XbeeApiMode> {};
INSTANTIATE_TEST_SUITE_P(XbeeFrames, BothModes,
                         ::testing::Values(XbeeApiMode::kPlain, XbeeApiMode::kEscaped));

// Every byte value inside, so that all escapes occur.
Bytes AllByteValues() {
  Bytes data;
  for (int byte = 0; byte < 256; ++byte) data.push_back(static_cast<std::uint8_t>(byte));
  return data;
}

TEST_P(BothModes, AFrameCutAnywhereIsPutTogether) {
  const Bytes frame = XbeeFrame(AllByteValues(), GetParam());
  for (std::size_t cut = 1; cut < frame.size(); ++cut) {
    XbeeDeframer deframer(GetParam());
    deframer.Push(std::span(frame).first(cut));
    EXPECT_FALSE(deframer.Next().has_value());
    deframer.Push(std::span(frame).subspan(cut));
    EXPECT_THAT(AllFrames(deframer), ElementsAre(AllByteValues()));
    EXPECT_EQ(deframer.broken(), 0);
    EXPECT_EQ(deframer.garbage(), 0);
  }
}

TEST_P(BothModes, EveryFlippedBitIsNoticed) {
  const Bytes data = {0x81, 0x00, 0x01, 0x37, 0x00, 'a', ' ', '-', '5'};
  const Bytes frame = XbeeFrame(data, GetParam());
  for (std::size_t byte = 0; byte < frame.size(); ++byte) {
    for (int bit = 0; bit < 8; ++bit) {
      Bytes flipped = frame;
      flipped[byte] ^= static_cast<std::uint8_t>(1 << bit);
      XbeeDeframer deframer(GetParam());
      deframer.Push(flipped);
      EXPECT_THAT(AllFrames(deframer), ElementsAre()) << byte << "." << bit;
    }
  }
}

TEST_P(BothModes, TheFrameAfterABrokenOneIsFound) {
  const Bytes good = XbeeFrame(kManualData, GetParam());
  Bytes broken = good;
  broken.back() ^= 0x01;
  XbeeDeframer deframer(GetParam());
  deframer.Push(broken);
  deframer.Push(good);
  EXPECT_THAT(AllFrames(deframer), ElementsAre(kManualData));
  EXPECT_EQ(deframer.broken(), 1);
}

TEST_P(BothModes, AFrameBehindACutOffOneIsFound) {
  const Bytes good = XbeeFrame(kManualData, GetParam());
  const Bytes longer = XbeeFrame(Bytes(30, 0x41), GetParam());
  XbeeDeframer deframer(GetParam());
  deframer.Push(std::span(longer).first(12));
  // In plain mode the cut is seen only when the bytes that were announced have come.
  for (int i = 0; i < 4; ++i) deframer.Push(good);
  EXPECT_THAT(AllFrames(deframer), ElementsAreArray(std::vector<Bytes>(4, kManualData)));
}

TEST_P(BothModes, ImpossibleLengthsAreNotWaitedFor) {
  const Bytes good = XbeeFrame(kManualData, GetParam());
  XbeeDeframer deframer(GetParam());
  deframer.Push(Bytes{0x7e, 0xff, 0xff});
  deframer.Push(Bytes{0x7e, 0x00, 0x00});
  deframer.Push(good);
  EXPECT_THAT(AllFrames(deframer), ElementsAre(kManualData));
}

TEST_P(BothModes, FramesAreFoundInAFloodOfNoise) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_int_distribution<int> length(0, 40);
  XbeeDeframer deframer(GetParam());
  int found = 0;
  constexpr int kFrames = 2000;
  for (int i = 0; i < kFrames; ++i) {
    Bytes noise(static_cast<std::size_t>(length(random)));
    for (auto& value : noise) {
      // A start byte in the noise may rightly swallow the frame behind it.
      do value = static_cast<std::uint8_t>(byte(random));
      while (value == 0x7e || (GetParam() == XbeeApiMode::kEscaped && value == 0x7d));
    }
    deframer.Push(noise);
    deframer.Push(XbeeFrame(kManualData, GetParam()));
    for (const Bytes& frame : AllFrames(deframer)) found += frame == kManualData ? 1 : 0;
  }
  EXPECT_EQ(found, kFrames);
}

TEST_P(BothModes, PureNoiseCostsNoMemoryAndHoldsNoFrames) {
  std::mt19937 random(2);
  std::uniform_int_distribution<int> byte(0, 255);
  XbeeDeframer deframer(GetParam());
  std::int64_t frames = 0;
  for (int i = 0; i < 1000; ++i) {
    Bytes noise(1000);
    for (auto& value : noise) value = static_cast<std::uint8_t>(byte(random));
    deframer.Push(noise);
    frames += static_cast<std::int64_t>(AllFrames(deframer).size());
  }
  // A checksum of one byte lets one of 256 false starts through; starts with a possible length are
  // rare.
  EXPECT_LT(frames, 100);
  EXPECT_GT(deframer.garbage(), 900'000);
}

}  // namespace
}  // namespace beckon
