// range_caster as a program: messages in, messages out.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <sstream>
#include <vector>

#include "beckon/ground_t.hpp"
#include "beckon/occupancy_grid_t.hpp"
#include "beckon/service_health_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "common/ground_camera.hpp"
#include "common/label_runs.hpp"
#include "common/message_bus.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using testing::Collector;
using testing::DispatchUntil;
using testing::Process;

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr char kRobot[] = R"(
[camera]
calibration = "camera.toml"
[range_caster]
bearing_step_deg = 0.5
)";

class RangeCasterProgram : public ::testing::Test {
 protected:
  RangeCasterProgram() {
    const GroundCamera camera = GroundCamera::Pinhole(kWidth, kHeight, 133.0, 0.55, 0.45);
    std::ostringstream text;
    text.precision(12);
    text << "width = " << kWidth << "\nheight = " << kHeight << "\n[camera]\nfx = " << camera.fx
         << "\nfy = " << camera.fy << "\ncx = " << camera.cx << "\ncy = " << camera.cy
         << "\nheight_m = 0.55\ntilt_down_deg = 25.78\n[ground]\nimage_to_ground = [";
    for (int i = 0; i < 9; ++i) {
      text << (i > 0 ? ", " : "") << camera.ground_from_image(i / 3, i % 3);
    }
    text << "]\n";
    files_.Write("camera.toml", text.str());
    config_ = files_.Write("robot.toml", kRobot);
    labels_ = cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(kGround));
    labels_.rowRange(0, 40).setTo(kNotGround);
  }

  ground_t Ground(Utime utime) const {
    ground_t message{};
    message.utime = utime;
    message.width = kWidth;
    message.height = kHeight;
    message.runs = EncodeLabels(labels_);
    message.size = static_cast<std::int32_t>(message.runs.size());
    return message;
  }
  // Sends the same frame until it is answered: at first, nobody may be listening yet.
  bool IsAnswered(Utime utime) {
    const auto is_there = [&] {
      return !scans_.messages().empty() && scans_.messages().back().utime == utime;
    };
    for (int attempt = 0; attempt < 100; ++attempt) {
      bus_.Publish(channels::kGround, Ground(utime));
      if (DispatchUntil(bus_, is_there, std::chrono::milliseconds(100))) return true;
    }
    return false;
  }

  testing::TempDir files_;
  std::filesystem::path config_;
  cv::Mat labels_;
  MessageBus bus_{kDefaultLcmUrl};
  Collector<bot_core::planar_lidar_t> scans_{bus_, channels::kScan};
  Collector<occupancy_grid_t> grids_{bus_, channels::kGrid};
  Collector<service_health_t> healths_{bus_, channels::kHealth};
};

TEST_F(RangeCasterProgram, AnswersEveryFrameWithAScanOfItsTime) {
  Process program("range_caster", {"--config", config_.string()});
  ASSERT_TRUE(IsAnswered(1));
  scans_.Clear();
  constexpr int kFrames = 50;
  for (int i = 0; i < kFrames; ++i) bus_.Publish(channels::kGround, Ground(1000 + i));
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return scans_.size() == kFrames; }));
  for (int i = 0; i < kFrames; ++i) {
    const auto& scan = scans_.messages()[static_cast<std::size_t>(i)];
    EXPECT_EQ(scan.utime, 1000 + i);
    ASSERT_GT(scan.nranges, 10);
    EXPECT_EQ(scan.nintensities, scan.nranges);
  }
  const auto& scan = scans_.messages().back();
  const auto ahead = static_cast<std::size_t>(std::lround(-scan.rad0 / scan.radstep));
  const GroundCamera camera = GroundCamera::Pinhole(kWidth, kHeight, 133.0, 0.55, 0.45);
  EXPECT_NEAR(scan.ranges[ahead], camera.GroundFromPixel({79.5, 39.5})->x(), 0.05);
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return grids_.size() > 0; }));
  EXPECT_EQ(grids_.messages().back().size,
            grids_.messages().back().width * grids_.messages().back().height);
}

TEST_F(RangeCasterProgram, RefusesCorruptFramesAndGoesOn) {
  Process program("range_caster", {"--config", config_.string()});
  ASSERT_TRUE(IsAnswered(1));
  ground_t short_runs = Ground(2);
  short_runs.runs.resize(short_runs.runs.size() / 2);
  short_runs.size = static_cast<std::int32_t>(short_runs.runs.size());
  bus_.Publish(channels::kGround, short_runs);
  ground_t other_camera = Ground(3);
  other_camera.width = 80;
  other_camera.height = 240;
  bus_.Publish(channels::kGround, other_camera);
  ground_t wild = Ground(4);
  wild.pitch_rad = std::nanf("");
  bus_.Publish(channels::kGround, wild);
  testing::PublishRaw(channels::kGround, {1, 2, 3});
  ASSERT_TRUE(IsAnswered(5));
  for (const auto& scan : scans_.messages()) EXPECT_TRUE(scan.utime == 1 || scan.utime == 5);
  healths_.Clear();
  ASSERT_TRUE(DispatchUntil(
      bus_, [&] { return healths_.size() > 0 && healths_.messages().back().refused == 4; }));
}

TEST_F(RangeCasterProgram, IsBackAfterItWasKilled) {
  {
    Process program("range_caster", {"--config", config_.string()});
    ASSERT_TRUE(IsAnswered(1));
    program.Signal(SIGKILL);
    EXPECT_EQ(program.WaitForExit(), 128 + SIGKILL);
  }
  Process program("range_caster", {"--config", config_.string()});
  EXPECT_TRUE(IsAnswered(2));
  program.Signal(SIGTERM);
  EXPECT_EQ(program.WaitForExit(), 0);
}

TEST_F(RangeCasterProgram, BadConfigurationIsNamedAndEndsWithTwo) {
  const auto wrong = files_.Write("wrong.toml",
                                  "[camera]\ncalibration = \"camera.toml\"\n"
                                  "[range_caster]\nbearing_step_deg = \"fine\"\n");
  const auto finished = testing::RunToEnd("range_caster", {"--config", wrong.string()});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_NE(finished.output.find("wrong.toml:4"), std::string::npos) << finished.output;
  EXPECT_NE(finished.output.find("bearing_step_deg"), std::string::npos) << finished.output;

  const auto no_camera = files_.Write("no_camera.toml", "[camera]\ncalibration = \"none.toml\"\n");
  const auto missing = testing::RunToEnd("range_caster", {"--config", no_camera.string()});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.output.find("none.toml"), std::string::npos) << missing.output;
}

}  // namespace
}  // namespace beckon
