// ground_detector as a program: messages in, messages out.
#include <gtest/gtest.h>
#include <signal.h>

#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "beckon/ground_t.hpp"
#include "beckon/planar_motion_t.hpp"
#include "beckon/service_health_t.hpp"
#include "bot_core/image_t.hpp"
#include "common/channels.hpp"
#include "common/label_runs.hpp"
#include "common/message_bus.hpp"
#include "tests/ground_detector/scene.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using testing::Collector;
using testing::DispatchUntil;
using testing::Process;

class GroundDetectorProgram : public ::testing::Test {
 protected:
  GroundDetectorProgram() {
    const GroundCamera camera = testing::TestCamera();
    std::ostringstream text;
    text.precision(12);
    text << "width = 320\nheight = 240\n[camera]\nfx = " << camera.fx << "\nfy = " << camera.fy
         << "\ncx = " << camera.cx << "\ncy = " << camera.cy
         << "\nheight_m = 0.5\ntilt_down_deg = 22.0\n[ground]\nimage_to_ground = [";
    for (int i = 0; i < 9; ++i) {
      text << (i > 0 ? ", " : "") << camera.ground_from_image(i / 3, i % 3);
    }
    text << "]\n";
    files_.Write("camera.toml", text.str());
    config_ = files_.Write("robot.toml", "[camera]\ncalibration = \"camera.toml\"\n");
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", testing::Render({}, camera, {}, 1).bgr, jpeg);
    image_.width = 320;
    image_.height = 240;
    image_.pixelformat = bot_core::image_t::PIXEL_FORMAT_MJPEG;
    image_.data = jpeg;
    image_.size = static_cast<std::int32_t>(jpeg.size());
  }

  bot_core::image_t Image(std::int64_t utime) const {
    bot_core::image_t image = image_;
    image.utime = utime;
    return image;
  }
  // Sends a frame until it is answered: at first, nobody may be listening yet.
  bool IsAnswered(std::int64_t utime) {
    const auto is_there = [&] {
      return grounds_.size() > 0 && grounds_.messages().back().utime == utime;
    };
    for (int attempt = 0; attempt < 50; ++attempt) {
      bus_.Publish(channels::kCamera, Image(utime));
      if (DispatchUntil(bus_, is_there, std::chrono::milliseconds(200))) return true;
    }
    return false;
  }

  testing::TempDir files_;
  std::filesystem::path config_;
  bot_core::image_t image_{};
  MessageBus bus_{kDefaultLcmUrl};
  Collector<ground_t> grounds_{bus_, channels::kGround};
  Collector<planar_motion_t> motions_{bus_, channels::kGroundMotion};
  Collector<service_health_t> healths_{bus_, channels::kHealth};
};

TEST_F(GroundDetectorProgram, AnswersFramesWithGroundAndMotionOfTheirTime) {
  Process program("ground_detector", {"--config", config_.string()});
  ASSERT_TRUE(IsAnswered(1'000'000));
  ASSERT_TRUE(IsAnswered(1'100'000));
  const auto& ground = grounds_.messages().back();
  const cv::Mat labels = DecodeLabels(ground.runs, ground.width, ground.height);
  EXPECT_EQ(labels.at<std::uint8_t>(230, 160), kGround);
  EXPECT_EQ(labels.at<std::uint8_t>(5, 160), kNotGround);
  ASSERT_TRUE(DispatchUntil(
      bus_, [&] { return motions_.size() > 0 && motions_.messages().back().utime == 1'100'000; }));
  EXPECT_EQ(motions_.messages().back().utime_from, 1'000'000);
  EXPECT_EQ(motions_.messages().back().status, planar_motion_t::OK);
}

TEST_F(GroundDetectorProgram, RefusesWhatIsNoFrameAndGoesOn) {
  Process program("ground_detector", {"--config", config_.string()});
  ASSERT_TRUE(IsAnswered(1));
  const auto refused = [&](std::int64_t count) {
    return DispatchUntil(
        bus_, [&] { return healths_.size() > 0 && healths_.messages().back().refused == count; });
  };
  bot_core::image_t cut = Image(2);
  cut.data.resize(cut.data.size() / 2);
  cut.size = static_cast<std::int32_t>(cut.data.size());
  bus_.Publish(channels::kCamera, cut);
  EXPECT_TRUE(refused(1));
  bot_core::image_t raw = Image(3);
  raw.pixelformat = 0;
  bus_.Publish(channels::kCamera, raw);
  EXPECT_TRUE(refused(2));
  testing::PublishRaw(channels::kCamera, {1, 2, 3});
  EXPECT_TRUE(refused(3));
  ASSERT_TRUE(IsAnswered(4));
  for (const auto& ground : grounds_.messages()) {
    EXPECT_TRUE(ground.utime == 1 || ground.utime == 4) << ground.utime;
  }
}

TEST_F(GroundDetectorProgram, IsBackAfterItWasKilled) {
  {
    Process program("ground_detector", {"--config", config_.string()});
    ASSERT_TRUE(IsAnswered(1));
    program.Signal(SIGKILL);
    EXPECT_EQ(program.WaitForExit(), 128 + SIGKILL);
  }
  Process program("ground_detector", {"--config", config_.string()});
  EXPECT_TRUE(IsAnswered(2));
  program.Signal(SIGTERM);
  EXPECT_EQ(program.WaitForExit(), 0);
}

TEST_F(GroundDetectorProgram, BadConfigurationIsNamedAndEndsWithTwo) {
  const auto wrong = files_.Write(
      "wrong.toml", "[camera]\ncalibration = \"camera.toml\"\n[ground_detector]\nmemory = 1.0\n");
  const auto finished = testing::RunToEnd("ground_detector", {"--config", wrong.string()});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_NE(finished.output.find("wrong.toml:4"), std::string::npos) << finished.output;
  EXPECT_NE(finished.output.find("memory"), std::string::npos) << finished.output;
}

}  // namespace
}  // namespace beckon
