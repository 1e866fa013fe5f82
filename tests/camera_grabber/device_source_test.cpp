// The V4L2 path against a device that keeps to the specification, in all but being one.
#include "services/camera_grabber/device_source.hpp"

#include <gmock/gmock.h>
#include <time.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/camera_grabber/fake_device.hpp"
#include "tests/camera_grabber/test_frames.hpp"

namespace beckon {
namespace {

using std::chrono::milliseconds;
using testing::FakeDevice;
using ::testing::HasSubstr;
using testing::TestJpeg;

constexpr milliseconds kNow{0};
const SystemClock kClock;

class DeviceSourceTest : public ::testing::Test {
 protected:
  DeviceOptions Options() const {
    DeviceOptions options;
    options.path = device_.path();
    options.width = 64;
    options.height = 48;
    return options;
  }
  std::unique_ptr<FrameSource> Open() { return OpenDeviceSource(Options(), 85, kClock); }
  std::string RefusalOf(const DeviceOptions& options) {
    try {
      OpenDeviceSource(options, 85, kClock);
    } catch (const SourceError& error) {
      return error.what();
    }
    return "accepted";
  }

  FakeDevice device_;
};

TEST_F(DeviceSourceTest, PassesJpegThroughDatedByTheDriver) {
  const auto source = Open();
  EXPECT_TRUE(device_.is_streaming);
  EXPECT_FALSE(source->Next(kNow));
  timespec steady{};
  clock_gettime(CLOCK_MONOTONIC, &steady);
  FakeDevice::Shot shot{TestJpeg(), V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, {}};
  shot.timestamp = {steady.tv_sec, steady.tv_nsec / 1000 - 300'000};  // 0.3 s ago
  if (shot.timestamp.tv_usec < 0)
    shot.timestamp = {steady.tv_sec - 1, steady.tv_nsec / 1000 + 700'000};
  device_.shots.push_back(shot);
  const Utime before = kClock.Now().utime;
  const auto frame = source->Next(kNow);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->jpeg, TestJpeg());
  EXPECT_GE(frame->utime, before - 301'000);
  EXPECT_LE(frame->utime, kClock.Now().utime - 300'000);

  shot.timestamp.tv_sec -= 3600;  // a driver whose clock is another one
  device_.shots.push_back(shot);
  const Utime arrival = kClock.Now().utime;
  EXPECT_GE(source->Next(kNow)->utime, arrival);
}

TEST_F(DeviceSourceTest, TheNewestFrameCountsAndBuffersComeBack) {
  const auto source = Open();
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 3; ++i) device_.shots.push_back({TestJpeg(16 * (i + 1), 16), 0, {}});
    const auto frame = source->Next(kNow);
    ASSERT_TRUE(frame) << round;
    EXPECT_EQ(frame->width, 48);
    EXPECT_EQ(source->TakeDropped(), 2);
  }
}

TEST_F(DeviceSourceTest, CompressesYuyvWhereThereIsNoJpeg) {
  device_.formats = {V4L2_PIX_FMT_YUYV};
  const auto source = Open();
  std::vector<std::uint8_t> grey(64 * 48 * 2, 128);
  for (std::size_t i = 0; i < grey.size(); i += 2) grey[i] = 200;
  device_.shots.push_back({grey, 0, {}});
  const auto frame = source->Next(kNow);
  ASSERT_TRUE(frame);
  const cv::Mat image = cv::imdecode(frame->jpeg, cv::IMREAD_COLOR);
  ASSERT_EQ(image.size(), cv::Size(64, 48));
  // Luma 16 to 235 is black to white.
  EXPECT_NEAR(cv::mean(image)[1], 255.0 * (200 - 16) / 219, 2.0);
  grey.resize(1000);
  device_.shots.push_back({grey, 0, {}});
  EXPECT_THROW(source->Next(kNow), FrameError);
}

TEST_F(DeviceSourceTest, DamagedFramesAreRefusedAndTheNextIsTaken) {
  const auto source = Open();
  device_.shots.push_back({TestJpeg(), V4L2_BUF_FLAG_ERROR, {}});
  EXPECT_THROW(source->Next(kNow), FrameError);
  std::vector<std::uint8_t> cut = TestJpeg();
  cut.resize(cut.size() / 2);
  device_.shots.push_back({cut, 0, {}});
  EXPECT_THROW(source->Next(kNow), FrameError);
  device_.shots.push_back({{}, 0, {}});
  EXPECT_THROW(source->Next(kNow), FrameError);
  device_.shots.push_back({TestJpeg(), 0, {}});
  EXPECT_TRUE(source->Next(kNow));
}

TEST_F(DeviceSourceTest, UnpluggedIsLostAndCanBeOpenedAgain) {
  auto source = Open();
  device_.unplugged = true;
  EXPECT_THROW(source->Next(kNow), SourceError);
  source.reset();
  EXPECT_THAT(RefusalOf(Options()), HasSubstr("is not a camera"));
  device_.unplugged = false;
  device_.shots.push_back({TestJpeg(), 0, {}});
  EXPECT_TRUE(Open()->Next(kNow));
}

TEST_F(DeviceSourceTest, SaysWhatTheDeviceLacks) {
  DeviceOptions options = Options();
  options.width = 640;
  options.height = 480;
  EXPECT_THAT(RefusalOf(options), HasSubstr("gives 64 x 48 instead of 640 x 480"));
  device_.formats = {V4L2_PIX_FMT_GREY};
  EXPECT_THAT(RefusalOf(Options()), HasSubstr("neither MJPEG nor YUYV"));
  device_.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_THAT(RefusalOf(Options()), HasSubstr("does not stream video"));
}

TEST_F(DeviceSourceTest, LocksWhatItIsToldToLock) {
  Open();
  EXPECT_TRUE(device_.controls.empty());
  DeviceOptions options = Options();
  options.rate_hz = 12.5;
  options.lock_exposure = true;
  options.exposure = 156;
  options.lock_white_balance = true;
  OpenDeviceSource(options, 85, kClock);
  EXPECT_DOUBLE_EQ(device_.rate_hz, 12.5);
  const std::map<std::uint32_t, int> expected = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL},
                                                 {V4L2_CID_EXPOSURE_ABSOLUTE, 156},
                                                 {V4L2_CID_AUTO_WHITE_BALANCE, 0}};
  EXPECT_EQ(device_.controls, expected);
}

}  // namespace
}  // namespace beckon
