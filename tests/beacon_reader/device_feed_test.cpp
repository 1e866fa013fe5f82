#include "services/beacon_reader/device_feed.hpp"

#include <gmock/gmock.h>

#include "tests/support/support.hpp"

namespace beckon {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

TEST(BackOff, DoublesUpToTwoSecondsAndStartsAnewAfterSuccess) {
  BackOff back_off;
  for (const int expected : {250, 500, 1000, 2000, 2000}) {
    EXPECT_EQ(back_off.Next(), milliseconds(expected));
  }
  back_off.Reset();
  EXPECT_EQ(back_off.Next(), milliseconds(250));
}

TEST(FeedHealth, TellsQuietFromUnintelligible) {
  ManualClock clock;
  FeedHealth health("/dev/radio", 5.0);
  health.OnOpened(clock.Now());
  EXPECT_EQ(health.At(clock.Now()).state, Health::kWaiting);

  DecoderCounts counts;
  counts.accepted = 1;
  health.OnBytes(counts, clock.Now());
  EXPECT_EQ(health.At(clock.Now()).state, Health::kOk);

  clock.Advance(std::chrono::seconds(5));
  EXPECT_EQ(health.At(clock.Now()).state, Health::kDegraded);
  EXPECT_THAT(health.At(clock.Now()).reason, HasSubstr("nothing heard from /dev/radio"));

  health.OnBytes(counts, clock.Now());  // bytes, but no more accepted than before
  EXPECT_EQ(health.At(clock.Now()).state, Health::kDegraded);
  EXPECT_THAT(health.At(clock.Now()).reason, HasSubstr("baud rate"));

  counts.accepted = 2;
  health.OnBytes(counts, clock.Now());
  EXPECT_EQ(health.At(clock.Now()).state, Health::kOk);
}

TEST(ByteStream, NamesWhatItCannotOpen) {
  try {
    ByteStream("/nowhere/radio", 9600);
    FAIL() << "opened what is not there";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot open /nowhere/radio: No such file"));
  }
  EXPECT_THROW(ByteStream("/tmp", 9600), std::runtime_error);
}

TEST(ByteStream, WaitsForWhatIsAppendedToAFile) {
  const testing::TempDir folder;
  const auto file = folder.Write("readings.txt", "a b -60\n");
  ByteStream stream(file.string(), 9600);
  EXPECT_EQ(stream.Read(milliseconds(1)).size(), 8U);
  EXPECT_TRUE(stream.Read(milliseconds(1)).empty());
  folder.Write("readings.txt", "a b -60\na b -61\n");
  EXPECT_EQ(stream.Read(milliseconds(1)).size(), 8U);
}

TEST(SplitTcp, TakesHostAndPortApart) {
  std::string host;
  std::string port;
  EXPECT_TRUE(SplitTcp("tcp:radio.local:7000", host, port));
  EXPECT_EQ(host, "radio.local");
  EXPECT_EQ(port, "7000");
  for (const char* bad : {"/dev/ttyUSB0", "tcp:", "tcp:host", "tcp:host:", "tcp::7000"}) {
    EXPECT_FALSE(SplitTcp(bad, host, port)) << bad;
  }
}

}  // namespace
}  // namespace beckon
