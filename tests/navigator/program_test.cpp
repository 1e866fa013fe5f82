// navigator as a program: messages in, messages out.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <limits>
#include <string>

#include "beckon/call_t.hpp"
#include "beckon/navigator_status_t.hpp"
#include "beckon/service_health_t.hpp"
#include "beckon/velocity_command_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "common/message_bus.hpp"
#include "common/pose_message.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using testing::Collector;
using testing::DispatchUntil;
using testing::Process;

class NavigatorProgram : public ::testing::Test {
 protected:
  NavigatorProgram() {
    files_.Write("site/site.toml", R"(
name = "hall"
[area]
min = [0.0, 0.0]
max = [20.0, 6.0]
[[beacons]]
id = "b1"
position = [1.0, 1.0, 2.0]
)");
    config_ = files_.Write("robot.toml", R"(
[site]
folder = "site"
[robot]
radius_m = 0.25
centre_x_m = -0.15
max_speed_mps = 0.5
[navigator]
resume_file = "call"
)");
  }

  // A robot at (2, 3) that looks along x, does what it is told, and sees free floor, also beside
  // itself.
  void Feed() {
    if (drives_.size() > 0) x_ += 0.05 * drives_.messages().back().linear_mps;
    const Utime utime = SystemClock().Now().utime;
    bus_.Publish(channels::kRobotPose, MessageFromPose(utime, {2.0 + x_, 3.0, 0.0}, 0.0, 0.0));
    bus_.Publish(channels::kOdometry, MessageFromPose(utime, {x_, 0.0, 0.0}, 0.0, 0.0));
    bot_core::planar_lidar_t scan{};
    scan.utime = utime;
    scan.nranges = scan.nintensities = 121;
    scan.ranges.assign(121, std::numeric_limits<float>::infinity());
    scan.intensities.assign(121, 5.0F);
    scan.rad0 = -2.4F;
    scan.radstep = 0.04F;
    bus_.Publish(channels::kScan, scan);
  }
  void CallTo(double x) {
    call_t call{};
    call.utime = SystemClock().Now().utime;
    call.kind = call_t::POINT;
    call.point[0] = x;
    call.point[1] = 3.0;
    bus_.Publish(channels::kCall, call);
  }
  // Feeds the program until `done` says so.
  bool FeedUntil(const std::function<bool()>& done) {
    for (int i = 0; i < 200; ++i) {
      Feed();
      if (DispatchUntil(bus_, done, std::chrono::milliseconds(50))) return true;
    }
    return false;
  }
  bool IsDriving() const {
    return drives_.size() > 0 && drives_.messages().back().linear_mps > 0.1;
  }
  const navigator_status_t* Status() const {
    return statuses_.size() > 0 ? &statuses_.messages().back() : nullptr;
  }

  testing::TempDir files_;
  std::filesystem::path config_;
  double x_ = 0.0;  // m driven
  MessageBus bus_{kDefaultLcmUrl};
  Collector<velocity_command_t> drives_{bus_, channels::kDrive};
  Collector<navigator_status_t> statuses_{bus_, channels::kNavigator};
  Collector<service_health_t> healths_{bus_, channels::kHealth};
};

TEST_F(NavigatorProgram, DrivesWhenCalledStopsWhenTheScanEndsAndSendsZerosOnSigterm) {
  Process program("navigator", {"--config", config_.string()});
  ASSERT_TRUE(FeedUntil([&] { return drives_.size() > 5; }));
  for (const auto& drive : drives_.messages()) {
    EXPECT_EQ(drive.linear_mps, 0.0);
    EXPECT_EQ(drive.angular_radps, 0.0);
  }
  CallTo(15.0);
  ASSERT_TRUE(FeedUntil([&] { return IsDriving(); }));
  EXPECT_EQ(Status()->state, navigator_status_t::DRIVING);
  EXPECT_NEAR(Status()->goal[0], 15.0, 1e-9);

  // Nothing comes any more.
  ASSERT_TRUE(DispatchUntil(bus_, [&] {
    return Status()->stop_reason == "scan_stale" && drives_.messages().back().linear_mps == 0.0;
  }));
  EXPECT_EQ(Status()->state, navigator_status_t::STOPPED);
  // It goes on by itself.
  ASSERT_TRUE(FeedUntil([&] { return IsDriving(); }));
  program.Signal(SIGTERM);
  EXPECT_EQ(program.WaitForExit(), 0);
  DispatchUntil(
      bus_, [] { return false; }, std::chrono::milliseconds(200));
  EXPECT_EQ(drives_.messages().back().linear_mps, 0.0);
  EXPECT_EQ(drives_.messages().back().angular_radps, 0.0);
  for (std::size_t i = 1; i < drives_.size(); ++i) {
    EXPECT_EQ(drives_.messages()[i].sequence, drives_.messages()[i - 1].sequence + 1);
  }
}

TEST_F(NavigatorProgram, NonsenseStopsItAndGoodMessagesSetItGoingAgain) {
  Process program("navigator", {"--config", config_.string()});
  ASSERT_TRUE(FeedUntil([&] { return Status() != nullptr; }));
  CallTo(15.0);
  ASSERT_TRUE(FeedUntil([&] { return IsDriving(); }));
  const auto is_stopped_for = [&](const std::string& reason) {
    return Status()->stop_reason == reason && drives_.messages().back().linear_mps == 0.0;
  };
  const auto stops_for = [&](const std::string& reason, const auto& disturb) {
    for (int i = 0; i < 100; ++i) {
      Feed();
      disturb();
      if (DispatchUntil(
              bus_, [&] { return is_stopped_for(reason); }, std::chrono::milliseconds(50))) {
        return true;
      }
    }
    return false;
  };
  EXPECT_TRUE(stops_for("scan_invalid", [&] {
    bot_core::planar_lidar_t scan{};
    scan.utime = SystemClock().Now().utime;
    scan.nranges = 3;
    scan.ranges = {1.0F, 2.0F, -3.0F};
    bus_.Publish(channels::kScan, scan);
  }));
  ASSERT_TRUE(FeedUntil([&] { return IsDriving(); }));
  EXPECT_TRUE(stops_for("pose_invalid", [&] {
    bot_core::pose_t pose = MessageFromPose(SystemClock().Now().utime, {}, 0.0, 0.0);
    pose.pos[0] = std::nan("");
    bus_.Publish(channels::kRobotPose, pose);
  }));
  ASSERT_TRUE(FeedUntil([&] { return IsDriving(); }));
  const auto refused_before = healths_.size() > 0 ? healths_.messages().back().refused : 0;
  EXPECT_TRUE(FeedUntil([&] {
    // Of SCAN and GRID only the newest is looked at, so that one bad message may pass unseen.
    for (const char* channel : {channels::kScan, channels::kGrid, channels::kCall,
                                channels::kLocation, channels::kRobotPose}) {
      testing::PublishRaw(channel, {0xde, 0xad, 0xbe, 0xef});
    }
    return healths_.size() > 0 && healths_.messages().back().refused >= refused_before + 5;
  }));
  EXPECT_TRUE(FeedUntil([&] { return IsDriving(); }));
}

TEST_F(NavigatorProgram, OfTwoCallsInOneBreathTheSecondIsAnswered) {
  Process program("navigator", {"--config", config_.string()});
  ASSERT_TRUE(FeedUntil([&] { return Status() != nullptr; }));
  CallTo(15.0);
  CallTo(12.0);
  ASSERT_TRUE(FeedUntil([&] { return IsDriving(); }));
  EXPECT_NEAR(Status()->goal[0], 12.0, 1e-9);
  call_t nonsense{};
  nonsense.utime = SystemClock().Now().utime;
  nonsense.kind = call_t::POINT;
  nonsense.point[0] = std::nan("");
  bus_.Publish(channels::kCall, nonsense);
  nonsense.kind = 77;
  bus_.Publish(channels::kCall, nonsense);
  call_t of_yesterday{};
  of_yesterday.utime = nonsense.utime - UtimeFromSeconds(86'400.0);
  of_yesterday.kind = call_t::POINT;
  of_yesterday.point[0] = 8.0;
  of_yesterday.point[1] = 3.0;
  bus_.Publish(channels::kCall, of_yesterday);
  ASSERT_TRUE(
      FeedUntil([&] { return healths_.size() > 0 && healths_.messages().back().refused >= 3; }));
  EXPECT_NEAR(Status()->goal[0], 12.0, 1e-9) << "the good one still holds";
  EXPECT_EQ(Status()->state, navigator_status_t::DRIVING);
}

TEST_F(NavigatorProgram, GoesOnWithItsCallAfterItWasKilled) {
  {
    Process program("navigator", {"--config", config_.string()});
    ASSERT_TRUE(FeedUntil([&] { return Status() != nullptr; }));
    CallTo(15.0);
    ASSERT_TRUE(FeedUntil([&] { return IsDriving(); }));
    program.Signal(SIGKILL);
    EXPECT_EQ(program.WaitForExit(), 128 + SIGKILL);
  }
  drives_.Clear();
  Process again("navigator", {"--config", config_.string()});
  ASSERT_TRUE(FeedUntil([&] { return IsDriving(); }));
  EXPECT_NEAR(Status()->goal[0], 15.0, 1e-9);
  // Cancelled: killed now, it has nothing to go on with.
  call_t cancel{};
  cancel.kind = call_t::CANCEL;
  bus_.Publish(channels::kCall, cancel);
  ASSERT_TRUE(FeedUntil([&] { return Status()->state == navigator_status_t::IDLE; }));
  again.Signal(SIGKILL);
  again.WaitForExit();
  statuses_.Clear();
  Process idle("navigator", {"--config", config_.string()});
  ASSERT_TRUE(FeedUntil([&] { return statuses_.size() > 5; }));
  for (const auto& status : statuses_.messages()) EXPECT_EQ(status.state, navigator_status_t::IDLE);
}

TEST_F(NavigatorProgram, BadConfigurationIsNamedAndEndsWithTwo) {
  const auto wrong =
      files_.Write("wrong.toml", "[site]\nfolder = \"site\"\n[navigator]\nscan_timeout_s = 5.0\n");
  const auto finished = testing::RunToEnd("navigator", {"--config", wrong.string()});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_NE(finished.output.find("wrong.toml:4"), std::string::npos) << finished.output;
  EXPECT_NE(finished.output.find("scan_timeout_s"), std::string::npos) << finished.output;
  const auto margins = files_.Write(
      "margins.toml", "[site]\nfolder = \"site\"\n[navigator]\nsafety_margin_m = 0.1\n");
  const auto refused = testing::RunToEnd("navigator", {"--config", margins.string()});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.output.find("follow_margin_m"), std::string::npos) << refused.output;
}

}  // namespace
}  // namespace beckon
