#include "services/beacon_reader/xbee_decoder.hpp"

#include <gmock/gmock.h>

namespace beckon {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

Bytes WithText(Bytes header, const std::string& text) {
  header.insert(header.end(), text.begin(), text.end());
  return header;
}

Bytes Receive16(std::uint8_t rssi, const std::string& payload) {
  return WithText({0x81, 0x00, 0x0a, rssi, 0x00}, payload);
}

class XbeeDecoderTest : public ::testing::Test {
 protected:
  std::vector<WireReading> Push(const Bytes& data) {
    return decoder_.Push(XbeeFrame(data, XbeeApiMode::kEscaped));
  }
  XbeeDecoder decoder_{XbeeOptions{}};
};

TEST_F(XbeeDecoderTest, AFrameIsAReadingOfTheRobot) {
  EXPECT_THAT(Push(Receive16(0x28, "")), ElementsAre(WireReading{"robot", "000A", -40.0}));
}

TEST_F(XbeeDecoderTest, PayloadLinesAreReportsOfTags) {
  EXPECT_THAT(Push(Receive16(55, "tag1 -61\ntag2 -70.5\r\n")),
              ElementsAre(WireReading{"robot", "000A", -55.0}, WireReading{"tag1", "000A", -61.0},
                          WireReading{"tag2", "000A", -70.5}));
}

TEST_F(XbeeDecoderTest, TheLastLineNeedsNoLineEnd) {
  EXPECT_THAT(Push(Receive16(55, "tag1 -61")),
              ElementsAre(WireReading{"robot", "000A", -55.0}, WireReading{"tag1", "000A", -61.0}));
}

TEST_F(XbeeDecoderTest, OtherPayloadsAreNotReports) {
  const std::vector<std::string> payloads = {"hello",
                                             "tag1 -61 extra",
                                             "tag1 nan",
                                             "tag1 inf",
                                             "tag1 -500",
                                             "tag1 -6x",
                                             " ",
                                             std::string("\0\1 -60", 6),
                                             std::string(90, 'a') + " -60"};
  for (const std::string& payload : payloads) {
    EXPECT_THAT(Push(Receive16(55, payload)), ElementsAre(WireReading{"robot", "000A", -55.0}))
        << payload;
  }
}

TEST_F(XbeeDecoderTest, LongAddressesAreSixteenDigits) {
  const Bytes data =
      WithText({0x80, 0x00, 0x13, 0xa2, 0x00, 0x40, 0xa1, 0xb2, 0xc3, 0x41, 0x00}, "tag1 -61\n");
  EXPECT_THAT(Push(data), ElementsAre(WireReading{"robot", "0013A20040A1B2C3", -65.0},
                                      WireReading{"tag1", "0013A20040A1B2C3", -61.0}));
}

TEST_F(XbeeDecoderTest, BeaconsGoByTheirConfiguredNames) {
  XbeeDecoder named({XbeeApiMode::kEscaped, "cart", {{"000A", "kitchen"}}});
  EXPECT_THAT(
      named.Push(XbeeFrame(Receive16(55, "tag1 -61"), XbeeApiMode::kEscaped)),
      ElementsAre(WireReading{"cart", "kitchen", -55.0}, WireReading{"tag1", "kitchen", -61.0}));
}

TEST_F(XbeeDecoderTest, APowerThatWasNotMeasuredIsRefusedButReportsAreUsed) {
  EXPECT_THAT(Push(Receive16(0, "tag1 -61")), ElementsAre(WireReading{"tag1", "000A", -61.0}));
  EXPECT_THAT(Push(Receive16(255, "tag1 -61")), ElementsAre(WireReading{"tag1", "000A", -61.0}));
  EXPECT_EQ(decoder_.counts().refused, 2);
}

TEST_F(XbeeDecoderTest, TruncatedFramesAreRefused) {
  for (const Bytes& data :
       {Bytes{0x81, 0x00, 0x0a, 0x28}, Bytes{0x80, 0, 0x13, 0xa2, 0, 0x40, 0xa1, 0xb2, 0xc3, 0x41},
        Bytes{0x90, 1, 2, 3}, Bytes{0x88, 1, 'D', 'B'}}) {
    EXPECT_THAT(Push(data), IsEmpty());
  }
  EXPECT_EQ(decoder_.counts().refused, 4);
  EXPECT_EQ(decoder_.counts().accepted, 0);
}

TEST_F(XbeeDecoderTest, OtherFramesAreNoReadings) {
  EXPECT_THAT(Push({0x8a, 0x06}), IsEmpty());  // modem status: coordinator started
  EXPECT_EQ(decoder_.counts().refused, 0);
}

const Bytes kMeshHeader = {0x90, 0, 0x13, 0xa2, 0, 0x40, 0xa1, 0xb2, 0xc3, 0xff, 0xfe, 0x01};
const Bytes kOtherMesh = {0x90, 0, 0x13, 0xa2, 0, 0x40, 0xa1, 0xb2, 0xc4, 0xff, 0xfe, 0x01};

TEST_F(XbeeDecoderTest, MeshPacketsAreAskedForTheirPower) {
  EXPECT_THAT(Push(WithText(kMeshHeader, "tag1 -61\n")),
              ElementsAre(WireReading{"tag1", "0013A20040A1B2C3", -61.0}));
  EXPECT_EQ(decoder_.TakeRequests(), XbeeFrame(Bytes{0x08, 1, 'D', 'B'}, XbeeApiMode::kEscaped));
  EXPECT_THAT(decoder_.TakeRequests(), IsEmpty());
  EXPECT_THAT(Push({0x88, 1, 'D', 'B', 0, 0x3c}),
              ElementsAre(WireReading{"robot", "0013A20040A1B2C3", -60.0}));
  // Said once, it is not said again.
  EXPECT_THAT(Push({0x88, 1, 'D', 'B', 0, 0x3c}), IsEmpty());
}

TEST_F(XbeeDecoderTest, ThePowerOfAnotherPacketIsNotMistaken) {
  Push(kMeshHeader);
  Push(kOtherMesh);
  EXPECT_THAT(Push({0x88, 1, 'D', 'B', 0, 0x3c}), IsEmpty()) << "the answer to the first question";
  EXPECT_THAT(Push({0x88, 2, 'D', 'B', 0, 0x3d}),
              ElementsAre(WireReading{"robot", "0013A20040A1B2C4", -61.0}));
}

TEST_F(XbeeDecoderTest, AnAnswerWithAnErrorIsRefused) {
  Push(kMeshHeader);
  EXPECT_THAT(Push({0x88, 1, 'D', 'B', 1, 0x3c}), IsEmpty());
  EXPECT_EQ(decoder_.counts().refused, 1);
}

TEST_F(XbeeDecoderTest, FrameIdsWrapWithoutZeroWhichMeansNoAnswer) {
  for (int i = 0; i < 256; ++i) Push(kMeshHeader);
  EXPECT_EQ(decoder_.TakeRequests(), XbeeFrame(Bytes{0x08, 1, 'D', 'B'}, XbeeApiMode::kEscaped));
}

TEST_F(XbeeDecoderTest, ARestartForgetsHalfAFrame) {
  const Bytes frame = XbeeFrame(Receive16(55, ""), XbeeApiMode::kEscaped);
  decoder_.Push(std::span(frame).first(4));
  decoder_.Restart();
  EXPECT_THAT(decoder_.Push(frame), ElementsAre(WireReading{"robot", "000A", -55.0}));
  EXPECT_EQ(decoder_.counts().refused, 0);
}

}  // namespace
}  // namespace beckon
