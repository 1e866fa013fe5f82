// The demo, as a user starts it, without a window.
#include <gmock/gmock.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "beckon/navigator_status_t.hpp"
#include "beckon/service_health_t.hpp"
#include "beckon/velocity_command_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using testing::DispatchUntil;
using ::testing::HasSubstr;

const char* const kServices[] = {"beacon_reader",   "rssi_localizer", "camera_grabber",
                                 "ground_detector", "range_caster",   "navigator"};

class MissionTest : public ::testing::Test {
 protected:
  MissionTest() {
    setenv("BECKON_RUN_DIR", run_directory_.path().c_str(), 1);
    setenv("BECKON_BIN_DIR", testing::BinDir().c_str(), 1);
    unsetenv("BECKON_LOG_DIR");
  }
  testing::Process StartDemo(const std::string& seed) {
    return {testing::SourceDir() / "tools/demo",
            {"--headless", "--no-build", "--seed", seed, "--timeout", "150"}};
  }
  std::string LogOf(const std::string& service) const {
    std::ifstream file(run_directory_.path() / "log" / (service + ".txt"));
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  testing::TempDir run_directory_;
};

TEST_F(MissionTest, TheRobotComesWhenItIsCalled) {
  testing::Process demo = StartDemo("1");
  const int exit_code = demo.WaitForExit(seconds(190));
  EXPECT_EQ(exit_code, 0) << demo.Output();
  EXPECT_THAT(demo.Output(), HasSubstr("arrived"));
  EXPECT_THAT(demo.Output(), HasSubstr("recorded log"));
  EXPECT_GT(std::filesystem::file_size(run_directory_.path() / "log/beckon.lcmlog.0"), 1'000'000U);
}

TEST_F(MissionTest, ARobotThatIsNotToldWhereItStartsFindsOut) {
  testing::Process demo{testing::SourceDir() / "tools/demo",
                        {"--headless", "--no-build", "--seed", "1", "--timeout", "150", "--lost"}};
  const int exit_code = demo.WaitForExit(seconds(190));
  EXPECT_EQ(exit_code, 0) << demo.Output();
  EXPECT_THAT(demo.Output(), HasSubstr("arrived"));
  EXPECT_THAT(demo.Output(), HasSubstr("looking for itself"));
}

constexpr double kScanTimeoutS = 0.5;  // after that the navigator brakes

// What a bystander on the network sees of one mission.
class Bystander {
 public:
  Bystander() : bus_(kDefaultLcmUrl) {
    bus_.Subscribe<service_health_t>(channels::kHealth, [this](const service_health_t& health) {
      pids_[health.service] = health.pid;
    });
    bus_.Subscribe<bot_core::planar_lidar_t>(
        channels::kScan,
        [this](const bot_core::planar_lidar_t& scan) { last_scan_utime_ = scan.utime; });
    bus_.Subscribe<velocity_command_t>(channels::kDrive, [this](const velocity_command_t& command) {
      drives_ = command.linear_mps != 0.0 || command.angular_radps != 0.0;
      const double speed_mps = std::abs(command.linear_mps);
      // Both are dated by their senders, so that a bystander who is late sees the same.
      const double scan_age_s = SecondsFromUtime(command.utime - last_scan_utime_);
      if (scan_age_s > kScanTimeoutS && speed_mps > 0.0 && speed_mps >= last_speed_mps_) {
        ++blind_commands_;
      }
      if (drives_) oldest_scan_s_ = std::max(oldest_scan_s_, scan_age_s);
      last_speed_mps_ = speed_mps;
    });
    bus_.Subscribe<navigator_status_t>(
        channels::kNavigator, [this](const navigator_status_t& status) { state_ = status.state; });
  }
  MessageBus& bus() { return bus_; }
  int PidOf(const std::string& service) { return pids_[service]; }
  bool drives() const { return drives_; }
  int state() const { return state_; }
  // Commands to move, without braking, on a scan older than is allowed.
  int blind_commands() const { return blind_commands_; }
  // Greatest age of the newest scan at which it had not come to a stand.
  double oldest_scan_s() const { return oldest_scan_s_; }

 private:
  MessageBus bus_;
  std::map<std::string, int> pids_;
  Utime last_scan_utime_ = 0;
  bool drives_ = false;
  int state_ = navigator_status_t::IDLE;
  double last_speed_mps_ = 0.0;
  int blind_commands_ = 0;
  double oldest_scan_s_ = 0.0;
};

TEST_F(MissionTest, EveryServiceMayBeKilledOnTheWay) {
  testing::Process demo = StartDemo("1");
  Bystander bystander;
  MessageBus& bus = bystander.bus();
  ASSERT_TRUE(DispatchUntil(
      bus, [&] { return bystander.state() == navigator_status_t::DRIVING; }, seconds(40)))
      << demo.Output();
  for (const char* service : kServices) {
    ASSERT_TRUE(DispatchUntil(
        bus, [&] { return bystander.drives(); }, seconds(30)))
        << "does not drive on before " << service << " is killed\n"
        << demo.Output();
    const int killed = bystander.PidOf(service);
    ASSERT_GT(killed, 0) << service;
    ASSERT_EQ(kill(killed, SIGKILL), 0);
    const auto since = steady_clock::now();
    ASSERT_TRUE(DispatchUntil(
        bus, [&] { return bystander.PidOf(service) != killed; }, seconds(10)))
        << service;
    EXPECT_LT(duration<double>(steady_clock::now() - since).count(), 2.0)
        << service << " came back late";
  }
  ASSERT_TRUE(DispatchUntil(
      bus, [&] { return !demo.IsRunning(); }, seconds(150)))
      << demo.Output();
  EXPECT_EQ(demo.WaitForExit(), 0) << demo.Output();
  EXPECT_EQ(bystander.blind_commands(), 0);
  // 0.6 m/s brought down by 0.8 m/s^2, and two periods of DRIVE.
  EXPECT_LT(bystander.oldest_scan_s(), kScanTimeoutS + 0.6 / 0.8 + 0.1);
}

}  // namespace
}  // namespace beckon
