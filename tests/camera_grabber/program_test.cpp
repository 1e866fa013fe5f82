// camera_grabber as a running program: frames in, CAMERA out, and what it says when there are none.
#include <gmock/gmock.h>

#include <csignal>

#include "beckon/service_health_t.hpp"
#include "bot_core/image_t.hpp"
#include "common/channels.hpp"
#include "tests/camera_grabber/stream_server.hpp"
#include "tests/camera_grabber/test_frames.hpp"
#include "tests/support/process.hpp"

namespace beckon {
namespace {

using std::chrono::milliseconds;
using testing::Collector;
using testing::DispatchUntil;
using ::testing::HasSubstr;
using testing::Part;
using testing::Process;
using testing::StreamServer;
using testing::TestJpeg;
using testing::TestJpegText;

class CameraGrabberTest : public ::testing::Test {
 protected:
  std::string Config(const std::string& table) {
    return folder_.Write("robot.toml", "[camera_grabber]\n" + table).string();
  }
  bool WaitForHealth(int state, const std::string& reason = "") {
    health_.Clear();
    return DispatchUntil(bus_, [&] {
      return health_.size() > 0 && health_.messages().back().state == state &&
             health_.messages().back().reason.find(reason) != std::string::npos;
    });
  }

  testing::TempDir folder_;
  MessageBus bus_{kDefaultLcmUrl};
  Collector<bot_core::image_t> frames_{bus_, channels::kCamera};
  Collector<service_health_t> health_{bus_, channels::kHealth};
};

TEST_F(CameraGrabberTest, SendsEveryFrameOfAFolderOnceAndUntouched) {
  std::filesystem::create_directory(folder_.path() / "frames");
  for (int i = 0; i < 8; ++i) {
    folder_.Write("frames/" + std::to_string(i) + ".jpg", TestJpegText(32, 32, 20 * i));
  }
  folder_.Write("frames/9.jpg", "damaged");
  Process grabber(
      "camera_grabber",
      {"--config",
       Config("source = 'folder'\npath = 'frames'\nrate_hz = 50\nstart_delay_s = 0.3\n")});
  ASSERT_TRUE(WaitForHealth(service_health_t::WAITING, "played to the end")) << grabber.Output();
  ASSERT_EQ(frames_.size(), 8U);
  for (int i = 0; i < 8; ++i) {
    const bot_core::image_t& frame = frames_.messages()[static_cast<std::size_t>(i)];
    EXPECT_EQ(frame.data, TestJpeg(32, 32, 20 * i));
    EXPECT_EQ(frame.width, 32);
    EXPECT_EQ(frame.pixelformat, bot_core::image_t::PIXEL_FORMAT_MJPEG);
    if (i == 0) continue;
    EXPECT_GT(frame.utime, frames_.messages()[static_cast<std::size_t>(i) - 1].utime);
  }
  EXPECT_EQ(health_.messages().back().received, 8);
  EXPECT_EQ(health_.messages().back().refused, 1);
  EXPECT_THAT(grabber.Output(), HasSubstr("9.jpg"));
  grabber.Signal(SIGTERM);
  EXPECT_EQ(grabber.WaitForExit(), 0);
}

TEST_F(CameraGrabberTest, OutlivesItsCameraAndItsOwnDeath) {
  const StreamServer::Script film = [](StreamServer::Client& client, int) {
    client.Send(StreamServer::kHeader);
    for (int i = 0; client.Send(Part(TestJpegText(64, 48, i % 200))); ++i) {
      std::this_thread::sleep_for(milliseconds(30));
    }
  };
  auto camera = std::make_unique<StreamServer>(film);
  const int port = camera->port();
  const std::string config = Config("source = 'network'\nurl = '" + camera->url() + "'\n");
  auto grabber =
      std::make_unique<Process>("camera_grabber", std::vector<std::string>{"--config", config});
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return frames_.size() > 3; })) << grabber->Output();
  ASSERT_TRUE(WaitForHealth(service_health_t::OK));

  camera.reset();
  ASSERT_TRUE(WaitForHealth(service_health_t::FAILED, "no connection")) << grabber->Output();
  EXPECT_TRUE(grabber->IsRunning());
  camera = std::make_unique<StreamServer>(film, port);
  frames_.Clear();
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return frames_.size() > 3; })) << grabber->Output();

  grabber->Signal(SIGKILL);
  EXPECT_EQ(grabber->WaitForExit(), 128 + SIGKILL);
  grabber =
      std::make_unique<Process>("camera_grabber", std::vector<std::string>{"--config", config});
  frames_.Clear();
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return frames_.size() > 3; })) << grabber->Output();
  grabber->Signal(SIGTERM);
  EXPECT_EQ(grabber->WaitForExit(), 0);
}

TEST_F(CameraGrabberTest, WarnsOnceOfFramesThatDoNotFitADatagramAndSendsThem) {
  std::filesystem::create_directory(folder_.path() / "frames");
  cv::Mat noise(600, 800, CV_8UC3);
  cv::randu(noise, 0, 255);
  const auto large = EncodeJpeg(noise, 95);
  ASSERT_GT(large.size(), 65536U);
  for (const char* name : {"frames/1.jpg", "frames/2.jpg"})
    folder_.Write(name, {large.begin(), large.end()});
  Process grabber("camera_grabber", {"--config", Config("source = 'folder'\npath = 'frames'\n")});
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return frames_.size() == 2; })) << grabber.Output();
  EXPECT_EQ(frames_.messages()[1].data, large);
  const std::string output = grabber.Output();
  const auto first = output.find("do not fit one datagram");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(output.find("do not fit one datagram", first + 1), std::string::npos);
}

TEST_F(CameraGrabberTest, AMissingDeviceIsToldAndTriedAgain) {
  Process grabber("camera_grabber", {"--config", Config("device = 'video_missing'\n")});
  ASSERT_TRUE(WaitForHealth(service_health_t::FAILED, "video_missing")) << grabber.Output();
  EXPECT_TRUE(grabber.IsRunning());
  grabber.Signal(SIGTERM);
  EXPECT_EQ(grabber.WaitForExit(), 0);
}

TEST_F(CameraGrabberTest, ABadConfigurationIsExitCodeTwo) {
  const auto done =
      testing::RunToEnd("camera_grabber", {"--config", Config("source = 'network'\n")});
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.output, HasSubstr("url"));
}

}  // namespace
}  // namespace beckon
