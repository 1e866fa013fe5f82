#include "services/rssi_localizer/input_guard.hpp"

#include <gmock/gmock.h>

#include <stdexcept>

namespace beckon {
namespace {

using Verdict = Localizer::Verdict;

TEST(InputGuard, AComplaintAboutAnUndeclaredBeaconEndsAMinuteAfterItWasLastHeard) {
  ManualClock clock;
  InputGuard guard;
  EXPECT_EQ(guard.Complaint(clock.Now()), "");
  const auto hear = [&](const std::string& beacon) {
    EXPECT_THROW(guard.Check(Verdict::kUndeclaredBeacon, {0, "tag", beacon, -60.0}, clock.Now()),
                 std::invalid_argument);
  };
  hear("x");
  clock.Advance(std::chrono::seconds(50));
  hear("y");
  EXPECT_THAT(guard.Complaint(clock.Now()), ::testing::HasSubstr("2 beacon(s)"));
  clock.Advance(std::chrono::seconds(20));
  EXPECT_THAT(guard.Complaint(clock.Now()), ::testing::HasSubstr("such as 'y'"));
  clock.Advance(std::chrono::seconds(41));
  EXPECT_EQ(guard.Complaint(clock.Now()), "");
  hear("x");
  EXPECT_THAT(guard.Complaint(clock.Now()), ::testing::HasSubstr("such as 'x'"));
}

}  // namespace
}  // namespace beckon
