// From frames to commands, counted.
#include <gtest/gtest.h>

#include "tools/viewer/answer_times.hpp"

namespace beckon {
namespace {

constexpr Utime kMs = 1000;

TEST(AnswerTimes, CountFromTheFrameToTheFirstCommandAfterItsScan) {
  AnswerTimes times;
  for (int i = 0; i < 100; ++i) {
    const Utime frame = i * 100 * kMs;
    times.OnFrame(frame);
    times.OnDrive(frame + 10 * kMs, frame + 12 * kMs);  // answers what came before
    times.OnScan(frame, frame + (i < 90 ? 50 : 80) * kMs);
    // Decided before the scan came, sent after it.
    times.OnDrive(frame + 49 * kMs, frame + 51 * kMs);
    times.OnDrive(frame + (i < 90 ? 58 : 88) * kMs, frame + (i < 90 ? 60 : 90) * kMs);
    times.OnDrive(frame + 98 * kMs, frame + 99 * kMs);
  }
  const auto summary = times.Summarize();
  EXPECT_EQ(summary.answered, 100);
  EXPECT_EQ(summary.unanswered, 0);
  EXPECT_DOUBLE_EQ(summary.median_s, 0.060);
  EXPECT_DOUBLE_EQ(summary.p95_s, 0.090);
}

TEST(AnswerTimes, FramesThatWerePassedOverAreToldAndThoseOnTheirWayAreNot) {
  AnswerTimes times;
  for (int i = 1; i <= 10; ++i) times.OnFrame(i * kMs);
  times.OnScan(0, 5 * kMs);  // of a frame from before the watch
  times.OnScan(4 * kMs, 20 * kMs);
  times.OnDrive(19 * kMs, 20 * kMs);  // decided before the scan came
  EXPECT_EQ(times.Summarize().answered, 0);
  times.OnDrive(20 * kMs, 21 * kMs);
  EXPECT_EQ(times.Summarize().answered, 1);
  EXPECT_EQ(times.Summarize().unanswered, 3);
  EXPECT_DOUBLE_EQ(times.Summarize().median_s, 0.017);
}

}  // namespace
}  // namespace beckon
