// Camera, ground and range as running programs, over a recorded sequence.
#include <gmock/gmock.h>

#include <csignal>
#include <map>
#include <set>

#include "beckon/ground_t.hpp"
#include "beckon/service_health_t.hpp"
#include "bot_core/image_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using std::chrono::seconds;
using testing::DispatchUntil;

class RecordedChainTest : public ::testing::Test {
 protected:
  std::string Config(const std::filesystem::path& sequence) {
    return directory_.Write("robot.toml", "[camera]\ncalibration = '" +
                                              (sequence / "sequence.toml").string() +
                                              "'\n[camera_grabber]\nsource = 'folder'\npath = '" +
                                              sequence.string() + "'\nloop = false\n");
  }
  testing::TempDir directory_;
};

TEST_F(RecordedChainTest, EveryFrameIsAnsweredByAScanOfItsOwnTime) {
  if (testing::SharedData().empty()) GTEST_SKIP() << testing::kNoSharedData;
  const std::string config = Config(testing::SharedData() / "sequences/dev_office");
  MessageBus bus(kDefaultLcmUrl);
  testing::Collector<bot_core::image_t> frames(bus, channels::kCamera);
  testing::Collector<ground_t> grounds(bus, channels::kGround);
  testing::Collector<bot_core::planar_lidar_t> scans(bus, channels::kScan);
  std::set<std::string> healthy;
  bus.Subscribe<service_health_t>(
      channels::kHealth, [&](const service_health_t& health) { healthy.insert(health.service); });

  testing::Process caster("range_caster", {"--config", config});
  testing::Process detector("ground_detector", {"--config", config});
  ASSERT_TRUE(DispatchUntil(bus, [&] { return healthy.size() == 2; }));
  testing::Process grabber("camera_grabber", {"--config", config});

  ASSERT_TRUE(DispatchUntil(
      bus, [&] { return scans.size() == 40; }, seconds(30)))
      << frames.size() << " frames, " << grounds.size() << " grounds, " << scans.size() << " scans";
  ASSERT_EQ(frames.size(), 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(grounds.messages()[i].utime, frames.messages()[i].utime) << i;
    EXPECT_EQ(scans.messages()[i].utime, frames.messages()[i].utime) << i;
  }
  // The scan is one of the scene: walls and boxes stand before this camera at 2 to 5 m.
  const auto& last = scans.messages().back();
  const auto measured = std::count_if(last.ranges.begin(), last.ranges.end(),
                                      [](float range) { return range > 0.5F && range < 8.0F; });
  EXPECT_GT(measured, static_cast<std::ptrdiff_t>(last.ranges.size()) / 3);
}

TEST_F(RecordedChainTest, ALogPlaysInPlaceOfTheCamera) {
  if (testing::SharedData().empty()) GTEST_SKIP() << testing::kNoSharedData;
  const std::string config = Config(testing::SharedData() / "sequences/dev_hall");
  const std::string log = directory_.path() / "drive.lcmlog";
  MessageBus bus(kDefaultLcmUrl);
  testing::Collector<bot_core::image_t> frames(bus, channels::kCamera);
  testing::Collector<bot_core::planar_lidar_t> scans(bus, channels::kScan);
  {
    testing::Process recorder(testing::SourceDir() / "tools/record", {log});
    ASSERT_TRUE(recorder.WaitForOutput("Recording"));
    testing::Process grabber("camera_grabber", {"--config", config});
    ASSERT_TRUE(DispatchUntil(bus, [&] { return frames.size() >= 20; }));
    grabber.Signal(SIGTERM);
    EXPECT_EQ(grabber.WaitForExit(), 0);
    recorder.Signal(SIGINT);
    EXPECT_EQ(recorder.WaitForExit(), 0) << recorder.Output();
  }
  std::vector<Utime> recorded;
  for (const auto& frame : frames.messages()) recorded.push_back(frame.utime);
  frames.Clear();

  testing::Process caster("range_caster", {"--config", config});
  testing::Process detector("ground_detector", {"--config", config});
  ASSERT_TRUE(caster.WaitForOutput("running"));
  ASSERT_TRUE(detector.WaitForOutput("running"));
  testing::Process replay(testing::SourceDir() / "tools/replay", {log});
  ASSERT_TRUE(DispatchUntil(
      bus, [&] { return !replay.IsRunning(); }, seconds(20)));
  EXPECT_EQ(replay.WaitForExit(), 0) << replay.Output();
  ASSERT_TRUE(DispatchUntil(bus, [&] {
    return scans.size() > 0 && scans.messages().back().utime == frames.messages().back().utime;
  }));
  // The recorder may have missed what was sent while it started.
  EXPECT_GE(frames.size() + 3, recorded.size());
  EXPECT_THAT(recorded, ::testing::Contains(frames.messages()[recorded.size() / 2].utime))
      << "recorded times are kept";
}

}  // namespace
}  // namespace beckon
