// The running program: messages in, messages out.
#include <gmock/gmock.h>

#include <cmath>
#include <csignal>
#include <limits>
#include <optional>

#include "beckon/location_t.hpp"
#include "beckon/probability_map_t.hpp"
#include "beckon/rssi_reading_t.hpp"
#include "beckon/service_health_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "common/pose_message.hpp"
#include "tests/rssi_localizer/example_site.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using testing::Collector;
using testing::DispatchUntil;
using testing::ExamplePathLoss;
using testing::Process;

class Program : public ::testing::Test {
 protected:
  Program() {
    std::string text =
        "name = \"example\"\n[area]\nmin = [0.0, 0.0]\nmax = [10.0, 8.0]\n"
        "[tag]\nheight_m = 1.0\n[evaluation]\nwindow_s = 1.0\n";
    for (const Beacon& beacon : site_.beacons) {
      text += "[[beacons]]\nid = \"" + beacon.id + "\"\nposition = [" +
              std::to_string(beacon.position.x()) + ", " + std::to_string(beacon.position.y()) +
              ", 2.0]\n";
    }
    folder_.Write("site/site.toml", text);
    std::string csv = "utime,tag,beacon,rssi_dbm,x_m,y_m\n";
    for (const CalibrationReading& at :
         testing::ExampleCalibration(site_, ExamplePathLoss(), 100, 4.0)) {
      csv += std::to_string(at.reading.utime) + ",tag," + at.reading.beacon + "," +
             std::to_string(at.reading.rssi_dbm) + "," + std::to_string(at.position.x()) + "," +
             std::to_string(at.position.y()) + "\n";
    }
    folder_.Write("site/calibration.csv", csv);
  }

  void Start(const std::string& more = "") {
    const auto config =
        folder_.Write("robot.toml",
                      "[site]\nfolder = \"site\"\n[rssi_localizer]\n"
                      "update_period_s = 0.1\nmap_from_odometry = [1.0, 2.0, 0.0]\n" +
                          more);
    process_.emplace("rssi_localizer", std::vector<std::string>{"--config", config.string()});
    ASSERT_TRUE(DispatchUntil(bus_, [&] { return health_.size() > 0; }));
  }
  void Publish(const std::string& beacon, float rssi) {
    rssi_reading_t message{};
    message.utime = SystemClock().Now().utime;
    message.tag = "tag";
    message.beacon = beacon;
    message.rssi_dbm = rssi;
    bus_.Publish(channels::kRssi, message);
  }
  // What a tag at this place hears, until the program says that it is there.
  bool HeardAt(const Eigen::Vector2d& place) {
    return DispatchUntil(bus_, [&] {
      for (const Beacon& beacon : site_.beacons) {
        Publish(beacon.id, static_cast<float>(ExamplePathLoss().MeanRssi(
                               BeaconDistance(beacon, site_.tag_height_m, place))));
      }
      if (locations_.size() == 0) return false;
      const location_t& last = locations_.messages().back();
      return last.status == location_t::OK && last.tag == "tag" && last.beacons == 5 &&
             std::hypot(last.position[0] - place.x(), last.position[1] - place.y()) < 1.0;
    });
  }

  Site site_ = testing::ExampleSite();
  testing::TempDir folder_;
  MessageBus bus_{kDefaultLcmUrl};
  Collector<location_t> locations_{bus_, channels::kLocation};
  Collector<probability_map_t> maps_{bus_, channels::kLocationMap};
  Collector<bot_core::pose_t> poses_{bus_, channels::kRobotPose};
  Collector<service_health_t> health_{bus_, channels::kHealth};
  std::optional<Process> process_;
};

TEST_F(Program, LocatesATagAndPublishesItsMap) {
  Start();
  EXPECT_EQ(health_.messages().back().state, service_health_t::WAITING);
  EXPECT_TRUE(HeardAt({2.0, 3.0}));
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return maps_.size() > 0; }));
  EXPECT_EQ(maps_.messages().back().tag, "tag");
  EXPECT_EQ(maps_.messages().back().width, 40);
  EXPECT_EQ(maps_.messages().back().height, 32);
  process_->Signal(SIGTERM);
  EXPECT_EQ(process_->WaitForExit(), 0);
}

TEST_F(Program, GoesOnAfterNonsense) {
  Start();
  ASSERT_TRUE(HeardAt({2.0, 3.0}));
  testing::PublishRaw(channels::kRssi, {1, 2, 3});
  Publish("a", std::numeric_limits<float>::quiet_NaN());
  for (int i = 0; i < 5; ++i) Publish("somewhere", -60.0F);
  EXPECT_TRUE(DispatchUntil(bus_, [&] {
    const service_health_t& last = health_.messages().back();
    return last.refused >= 7 && last.state == service_health_t::DEGRADED &&
           last.reason.find("'somewhere'") != std::string::npos;
  }));
  EXPECT_TRUE(HeardAt({8.0, 6.0}));
  // Five readings of it, but one line.
  const std::string log = process_->Output();
  const std::size_t first = log.find("beacon 'somewhere' is not declared in the site file");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(log.find("beacon 'somewhere' is not declared in the site file", first + 1),
            std::string::npos);
}

TEST_F(Program, KilledAndRestartedLocatesAgain) {
  Start();
  ASSERT_TRUE(HeardAt({2.0, 3.0}));
  process_->Signal(SIGKILL);
  EXPECT_EQ(process_->WaitForExit(), 128 + SIGKILL);
  health_.Clear();
  locations_.Clear();
  Start();
  EXPECT_TRUE(HeardAt({2.0, 3.0}));
}

TEST_F(Program, AnswersOdometryWithTheRobotPose) {
  Start();
  bot_core::pose_t broken = MessageFromPose(1, {0.0, 0.0, 0.0}, 0.0, 0.0);
  broken.orientation[0] = 7.0;
  bus_.Publish(channels::kOdometry, broken);
  bus_.Publish(channels::kOdometry, MessageFromPose(42, {0.5, 0.25, 1.0}, 0.3, 0.1));
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return poses_.size() > 0; }));
  EXPECT_EQ(poses_.messages()[0].utime, 42);
  // The start is known to a decimetre and a few degrees; the mean of the particles is nearer.
  EXPECT_NEAR(poses_.messages()[0].pos[0], 1.5, 0.03);
  EXPECT_NEAR(poses_.messages()[0].pos[1], 2.25, 0.03);
  EXPECT_NEAR(PoseFromMessage(poses_.messages()[0]).theta, 1.0, 0.015);
}

TEST_F(Program, KeepsWhatTheRobotHearsAlongItsWay) {
  Start("own_readings = \"own.csv\"\n");
  double x = 0.0;
  Utime utime = SystemClock().Now().utime;
  const auto file = folder_.path() / "own.csv";
  ASSERT_TRUE(DispatchUntil(bus_, [&] {
    x = std::min(3.0, x + 0.05);
    bus_.Publish(channels::kOdometry, MessageFromPose(utime += 20'000, {x, 0.0, 0.0}, 0.0, 0.0));
    rssi_reading_t message{};
    message.utime = utime;
    message.tag = "robot";
    message.beacon = "a";
    message.rssi_dbm = -60.0F;
    bus_.Publish(channels::kRssi, message);
    return std::filesystem::exists(file) && LoadRobotCalibration(file, site_).size() >= 20;
  }));
  const auto readings = LoadRobotCalibration(file, site_);
  EXPECT_EQ(readings.front().reading.tag, "robot");
  // The odometry frame lies at (1, 2).
  EXPECT_GT(readings.back().position.x(), 1.3);
  EXPECT_NEAR(readings.back().position.y(), 2.0, 0.2);
}

TEST_F(Program, RefusesABadConfiguration) {
  const auto config = folder_.Write("bad.toml", "[site]\nfolder = \"nowhere\"\n");
  const testing::Finished run = testing::RunToEnd("rssi_localizer", {"--config", config.string()});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.output, ::testing::HasSubstr("nowhere"));
}

}  // namespace
}  // namespace beckon
