#include "services/beacon_reader/line_decoder.hpp"

#include <gmock/gmock.h>

namespace beckon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<WireReading> Push(LineDecoder& decoder, const std::string& text) {
  return decoder.Push({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(LineDecoder, ReadsBeaconTagAndPower) {
  LineDecoder decoder;
  EXPECT_THAT(
      Push(decoder, "kitchen tag7 -63.5\nhall\ttag8  -70\r\n"),
      ElementsAre(WireReading{"tag7", "kitchen", -63.5}, WireReading{"tag8", "hall", -70.0}));
  EXPECT_EQ(decoder.counts().accepted, 2);
}

TEST(LineDecoder, PutsPiecesTogether) {
  LineDecoder decoder;
  EXPECT_THAT(Push(decoder, "kit"), IsEmpty());
  EXPECT_THAT(Push(decoder, "chen tag7 -6"), IsEmpty());
  EXPECT_THAT(Push(decoder, "3\n"), ElementsAre(WireReading{"tag7", "kitchen", -63.0}));
}

TEST(LineDecoder, RefusesWhatIsNoReading) {
  const std::vector<std::string> lines = {"a b\n",      "a b c\n",         "a b -60 d\n",
                                          "a b nan\n",  "a b -60dBm\n",    "a b 80\n",
                                          "a b -1e9\n", "\xff\xfe b -60\n"};
  for (const std::string& line : lines) {
    LineDecoder decoder;
    EXPECT_THAT(Push(decoder, line), IsEmpty()) << line;
    EXPECT_EQ(decoder.counts().refused, 1) << line;
    EXPECT_THAT(Push(decoder, "a b -60\n"), ElementsAre(WireReading{"b", "a", -60.0})) << line;
  }
}

TEST(LineDecoder, PassesOverEmptyLinesAndComments) {
  LineDecoder decoder;
  EXPECT_THAT(Push(decoder, "\n  \r\n# a b -60\n"), IsEmpty());
  EXPECT_EQ(decoder.counts().refused, 0);
}

TEST(LineDecoder, AnEndlessLineIsRefusedOnceAndTheNextIsRead) {
  LineDecoder decoder;
  for (int i = 0; i < 1000; ++i) EXPECT_THAT(Push(decoder, std::string(10'000, 'x')), IsEmpty());
  // Its tail looks like a reading, but is not the whole line.
  EXPECT_THAT(Push(decoder, " b -60\na b -61\n"), ElementsAre(WireReading{"b", "a", -61.0}));
  EXPECT_EQ(decoder.counts().refused, 1);
}

}  // namespace
}  // namespace beckon
