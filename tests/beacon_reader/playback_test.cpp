#include "services/beacon_reader/playback.hpp"

#include <gmock/gmock.h>

namespace beckon {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Utime kRecorded = 1'000'000;
const std::vector<Reading> kReadings = {{kRecorded + 2'000'000, "tag", "b", -62.0},
                                        {kRecorded, "tag", "a", -60.0},
                                        {kRecorded + 500'000, "tag", "a", -61.0}};

std::vector<double> Powers(const std::vector<Reading>& readings) {
  std::vector<double> powers;
  for (const Reading& reading : readings) powers.push_back(reading.rssi_dbm);
  return powers;
}

TEST(Playback, PlaysInTheOrderAndPaceOfTheRecording) {
  ManualClock clock;
  Playback playback(kReadings, {});
  EXPECT_THAT(Powers(playback.Due(clock.Now())), ElementsAre(-60.0));
  clock.Advance(milliseconds(499));
  EXPECT_THAT(playback.Due(clock.Now()), IsEmpty());
  clock.Advance(milliseconds(1));
  EXPECT_THAT(Powers(playback.Due(clock.Now())), ElementsAre(-61.0));
  EXPECT_FALSE(playback.ended());
  clock.Advance(milliseconds(1500));
  EXPECT_THAT(Powers(playback.Due(clock.Now())), ElementsAre(-62.0));
  EXPECT_TRUE(playback.ended());
}

TEST(Playback, DatesReadingsToWhenTheyWereDue) {
  ManualClock clock;
  const Utime start = clock.Now().utime;
  Playback playback(kReadings, {.speed = 2.0});
  playback.Due(clock.Now());
  clock.Advance(milliseconds(1700));
  const std::vector<Reading> late = playback.Due(clock.Now());
  ASSERT_EQ(late.size(), 2U);
  EXPECT_EQ(late[0].utime, start + 250'000);
  EXPECT_EQ(late[1].utime, start + 1'000'000);
}

TEST(Playback, KeepsRecordedDatesWhereAsked) {
  ManualClock clock;
  Playback playback(kReadings, {.restamp = false});
  EXPECT_EQ(playback.Due(clock.Now()).front().utime, kRecorded);
}

TEST(Playback, LoopsASecondAfterTheEnd) {
  ManualClock clock;
  Playback playback(kReadings, {.loop = true});
  playback.Due(clock.Now());
  clock.Advance(milliseconds(2000));
  EXPECT_EQ(playback.Due(clock.Now()).size(), 2U);
  clock.Advance(milliseconds(999));
  playback.Due(clock.Now());
  EXPECT_THAT(playback.Due(clock.Now()), IsEmpty());
  clock.Advance(milliseconds(1));
  playback.Due(clock.Now());
  EXPECT_THAT(Powers(playback.Due(clock.Now())), ElementsAre(-60.0));
  EXPECT_FALSE(playback.ended());
}

TEST(Playback, AJumpOfTheWallClockDoesNotStopIt) {
  ManualClock clock;
  Playback playback(kReadings, {});
  playback.Due(clock.Now());
  clock.StepWallClock(std::chrono::hours(-1));
  clock.Advance(milliseconds(500));
  const std::vector<Reading> due = playback.Due(clock.Now());
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due.front().utime, clock.Now().utime);
}

}  // namespace
}  // namespace beckon
