#include <gmock/gmock.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "services/camera_grabber/device_source.hpp"
#include "services/camera_grabber/folder_source.hpp"
#include "services/camera_grabber/grabber.hpp"
#include "services/camera_grabber/video_source.hpp"
#include "tests/camera_grabber/test_frames.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TempDir;
using testing::TestJpeg;
using testing::TestJpegText;

constexpr milliseconds kNow{0};

template <typename Function>
std::string ErrorOf(const Function& function) {
  try {
    function();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

// A sequence of three frames at 4 Hz, of widths 16, 32 and 48.
void WriteSequence(const TempDir& folder) {
  std::filesystem::create_directory(folder.path() / "frames");
  for (int i = 0; i < 3; ++i) {
    folder.Write("frames/00000" + std::to_string(i) + ".jpg", TestJpegText(16 * (i + 1), 16));
  }
  folder.Write("sequence.toml", "rate_hz = 4.0\nname = 'test'\n");
}

TEST(FolderSource, PlaysASequenceAtItsRateInOrderThenEnds) {
  const TempDir folder;
  WriteSequence(folder);
  ManualClock clock;
  const auto source = OpenFolderSource({.path = folder.path()}, 85, clock);
  const Utime start = clock.Now().utime;
  std::vector<Utime> times;
  std::vector<int> widths;
  for (int i = 0; i < 100; ++i) {
    if (const auto frame = source->Next(kNow)) {
      times.push_back(frame->utime - start);
      widths.push_back(frame->width);
    }
    clock.Advance(milliseconds(10));
  }
  EXPECT_THAT(widths, ElementsAre(16, 32, 48));
  EXPECT_THAT(times, ElementsAre(0, 250'000, 500'000));
  EXPECT_TRUE(source->ended());
}

TEST(FolderSource, TakesAnotherRateADelayAndStartsAgainWhereToldTo) {
  const TempDir folder;
  WriteSequence(folder);
  ManualClock clock;
  const auto source = OpenFolderSource(
      {.path = folder.path(), .rate_hz = 20.0, .loop = true, .start_delay_s = 2.0}, 85, clock);
  EXPECT_FALSE(source->Next(kNow));
  clock.Advance(milliseconds(1990));
  EXPECT_FALSE(source->Next(kNow));
  std::vector<int> widths;
  for (int i = 0; i < 5; ++i) {
    clock.Advance(milliseconds(50));
    const auto frame = source->Next(kNow);
    ASSERT_TRUE(frame);
    widths.push_back(frame->width);
  }
  EXPECT_THAT(widths, ElementsAre(16, 32, 48, 16, 32));
  EXPECT_FALSE(source->ended());
}

TEST(FolderSource, LeavesNoFrameOutForAReaderWhoIsLate) {
  const TempDir folder;
  WriteSequence(folder);
  ManualClock clock;
  const auto source = OpenFolderSource({.path = folder.path()}, 85, clock);
  EXPECT_EQ(source->Next(kNow)->width, 16);
  clock.Advance(seconds(10));
  EXPECT_EQ(source->Next(kNow)->width, 32);
  EXPECT_EQ(source->Next(kNow)->width, 48);  // one frame is made up for, not ten seconds
}

TEST(FolderSource, RefusesDamageByNameAndGoesOn) {
  const TempDir folder;
  folder.Write("a.jpg", TestJpegText());
  folder.Write("b.jpg", TestJpegText().substr(0, 300));
  folder.Write("c.jpeg", "not a picture");
  cv::imwrite((folder.path() / "d.png").string(), cv::Mat(20, 30, CV_8UC3, cv::Scalar::all(50)));
  folder.Write("e.png", "not a picture either");
  folder.Write("notes.txt", "not looked at");
  ManualClock clock;
  const auto source = OpenFolderSource({.path = folder.path(), .rate_hz = 1000.0}, 85, clock);
  const auto next = [&] {
    clock.Advance(seconds(1));
    return source->Next(kNow);
  };
  EXPECT_EQ(next()->jpeg, TestJpeg());
  EXPECT_THAT(ErrorOf(next),
              ::testing::AllOf(HasSubstr("b.jpg"), HasSubstr("cut short after 300 bytes")));
  EXPECT_THAT(ErrorOf(next),
              ::testing::AllOf(HasSubstr("c.jpeg"), HasSubstr("does not begin like a JPEG")));
  EXPECT_EQ(next()->width, 30);
  EXPECT_THAT(ErrorOf(next), HasSubstr("e.png"));
  EXPECT_TRUE(source->ended());
}

TEST(FolderSource, OddFramesArePassedOnAndImpossibleOnesRefused) {
  const TempDir folder;
  const auto write = [&](const char* name, int width, int height) {
    cv::imwrite((folder.path() / name).string(), cv::Mat(height, width, CV_8UC3, cv::Scalar()));
  };
  folder.Write("a.jpg", TestJpegText(64, 48, 0));  // black
  write("b.png", 3840, 2160);
  write("c.png", 70'000, 1);  // more than a JPEG can hold
  folder.Write("e.jpg", TestJpegText(320, 240));
  ManualClock clock;
  Grabber grabber(
      [&] { return OpenFolderSource({.path = folder.path(), .rate_hz = 1000.0}, 85, clock); }, {},
      clock);
  std::vector<int> widths;
  for (int i = 0; i < 5; ++i) {
    if (const auto frame = grabber.Next(kNow)) widths.push_back(frame->width);
    clock.Advance(seconds(1));
  }
  EXPECT_THAT(widths, ElementsAre(64, 3840, 320));
  EXPECT_EQ(grabber.TakeCounts().refused, 1);
}

TEST(FolderSource, AFolderWithoutPicturesIsNoSource) {
  const TempDir folder;
  ManualClock clock;
  EXPECT_THAT(ErrorOf([&] { OpenFolderSource({.path = folder.path()}, 85, clock); }),
              HasSubstr(folder.path().string()));
  EXPECT_THAT(ErrorOf([&] { OpenFolderSource({.path = folder.path() / "missing"}, 85, clock); }),
              HasSubstr("missing"));
  WriteSequence(folder);
  folder.Write("sequence.toml", "rate_hz = 'fast'\n");
  EXPECT_THAT(ErrorOf([&] { OpenFolderSource({.path = folder.path()}, 85, clock); }),
              HasSubstr("sequence.toml:1"));
}

TEST(VideoFile, PlaysAtItsRateAndEnds) {
  const TempDir folder;
  const auto file = folder.path() / "video.avi";
  {
    cv::VideoWriter writer(file.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 5.0,
                           {64, 48});
    ASSERT_TRUE(writer.isOpened());
    for (int i = 0; i < 3; ++i)
      writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(40 + 80 * i)));
  }
  ManualClock clock;
  const auto source = OpenVideoFile({.path = file}, 85, clock);
  const Utime start = clock.Now().utime;
  std::vector<Utime> times;
  std::vector<int> levels;
  for (int i = 0; i < 100; ++i) {
    if (const auto frame = source->Next(kNow)) {
      times.push_back(frame->utime - start);
      const cv::Mat image = cv::imdecode(frame->jpeg, cv::IMREAD_GRAYSCALE);
      levels.push_back(static_cast<int>(std::lround(cv::mean(image)[0] / 10.0)) * 10);
    }
    clock.Advance(milliseconds(20));
  }
  EXPECT_THAT(times, ElementsAre(0, 200'000, 400'000));
  EXPECT_THAT(levels, ElementsAre(40, 120, 200));
  EXPECT_TRUE(source->ended());
}

TEST(VideoFile, SaysWhatIsWrongWithIt) {
  const TempDir folder;
  ManualClock clock;
  const auto not_video = folder.Write("not.avi", "not a video");
  EXPECT_THAT(ErrorOf([&] { OpenVideoFile({.path = not_video}, 85, clock); }),
              HasSubstr("not.avi"));
  EXPECT_THAT(ErrorOf([&] { OpenVideoFile({.path = "/nowhere.avi"}, 85, clock); }),
              HasSubstr("/nowhere.avi"));
}

TEST(DeviceSource, SaysWhyADeviceIsNoCamera) {
  const SystemClock clock;
  EXPECT_THAT(ErrorOf([&] { OpenDeviceSource({.path = "/dev/video_missing"}, 85, clock); }),
              ::testing::AllOf(HasSubstr("/dev/video_missing"), HasSubstr("No such file")));
  EXPECT_THAT(ErrorOf([&] { OpenDeviceSource({.path = "/dev/null"}, 85, clock); }),
              HasSubstr("/dev/null is not a camera"));
}

TEST(RtspStream, SaysThatThereIsNoStream) {
  const SystemClock clock;
  EXPECT_THAT(ErrorOf([&] { OpenRtspStream("rtsp://127.0.0.1:9/none", 85, clock); }),
              HasSubstr("rtsp://127.0.0.1:9/none"));
}

// A source that does what the test says.
struct Script {
  std::function<std::optional<Frame>()> next;
  bool may_repeat = false;
  int opened = 0;
};
class ScriptedSource : public FrameSource {
 public:
  explicit ScriptedSource(Script& script) : script_(script) { ++script_.opened; }
  std::optional<Frame> Next(milliseconds) override { return script_.next(); }
  bool may_repeat() const override { return script_.may_repeat; }

 private:
  Script& script_;
};

class GrabberTest : public ::testing::Test {
 protected:
  // Turns the grabber over for this long.
  int Run(milliseconds duration) {
    int frames = 0;
    for (milliseconds t{0}; t < duration; t += milliseconds(50)) {
      frames += grabber_.Next(kNow).has_value();
      clock_.Advance(milliseconds(50));
    }
    return frames;
  }

  // A picture like no other.
  Frame Fresh() { return {.jpeg = {++number_}}; }

  ManualClock clock_;
  Script script_;
  std::uint8_t number_ = 0;
  Grabber grabber_{[this] { return std::make_unique<ScriptedSource>(script_); }, {}, clock_};
};

TEST_F(GrabberTest, NoticesSilenceWithinASecondAndOpensAnew) {
  script_.next = [this] { return Fresh(); };
  EXPECT_EQ(Run(milliseconds(500)), 10);
  EXPECT_EQ(grabber_.state(), Grabber::State::kStreaming);
  script_.next = [] { return std::nullopt; };
  Run(milliseconds(900));
  EXPECT_EQ(script_.opened, 1);
  Run(milliseconds(250));
  EXPECT_EQ(grabber_.state(), Grabber::State::kLost);
  EXPECT_THAT(grabber_.reason(), HasSubstr("no frame for"));
  Run(milliseconds(500));
  EXPECT_EQ(script_.opened, 2);
  EXPECT_EQ(grabber_.state(), Grabber::State::kLost);  // open, but not delivering yet
  script_.next = [this] { return Fresh(); };
  EXPECT_GT(Run(milliseconds(500)), 0);
  EXPECT_EQ(script_.opened, 2);
  EXPECT_EQ(grabber_.reason(), "");
}

TEST_F(GrabberTest, OnePictureAgainAndAgainIsAFrozenCamera) {
  const Frame still{.jpeg = {1, 2, 3}};
  script_.next = [&] { return still; };
  EXPECT_EQ(Run(milliseconds(900)), 1) << "repeats are not sent as new";
  EXPECT_EQ(grabber_.state(), Grabber::State::kStreaming);
  Run(milliseconds(250));
  EXPECT_EQ(grabber_.state(), Grabber::State::kLost);
  EXPECT_THAT(grabber_.reason(), HasSubstr("the same picture"));
  EXPECT_EQ(grabber_.TakeCounts().received, 1);
  EXPECT_EQ(Run(milliseconds(10'000)), 0) << "nor after it was opened anew";
  EXPECT_GT(script_.opened, 1);
  EXPECT_EQ(grabber_.state(), Grabber::State::kLost);
  EXPECT_THAT(grabber_.reason(), HasSubstr("the same picture"));
  script_.next = [this] { return Fresh(); };
  EXPECT_GT(Run(milliseconds(2500)), 0);
  EXPECT_EQ(grabber_.state(), Grabber::State::kStreaming);
}

// A server that sends each picture twice is no frozen camera.
TEST_F(GrabberTest, OfPicturesThatComeTwiceOneIsSent) {
  int turn = 0;
  script_.next = [&] { return ++turn % 2 == 0 ? Frame{.jpeg = {number_}} : Fresh(); };
  EXPECT_EQ(Run(milliseconds(4000)), 40);
  EXPECT_EQ(grabber_.TakeCounts().dropped, 40);
  EXPECT_EQ(script_.opened, 1);
}

TEST_F(GrabberTest, WhatMayRepeatItselfMay) {
  const Frame still{.jpeg = {1, 2, 3}};
  script_.next = [&] { return still; };
  script_.may_repeat = true;
  EXPECT_EQ(Run(milliseconds(3000)), 60);
  script_.may_repeat = false;
  Grabber tolerant([this] { return std::make_unique<ScriptedSource>(script_); },
                   {.allow_repeats = true}, clock_);
  for (int i = 0; i < 60; ++i) {
    EXPECT_TRUE(tolerant.Next(kNow));
    clock_.Advance(milliseconds(50));
  }
  EXPECT_EQ(tolerant.state(), Grabber::State::kStreaming);
}

TEST_F(GrabberTest, GivesACameraTimeForItsFirstFrame) {
  script_.next = [] { return std::nullopt; };
  Run(milliseconds(3900));
  EXPECT_EQ(script_.opened, 1);
  script_.next = [this] { return Fresh(); };
  EXPECT_GT(Run(milliseconds(100)), 0);
  script_.next = [] { return std::nullopt; };
  Run(milliseconds(1200));
  EXPECT_EQ(grabber_.state(), Grabber::State::kLost);
  Run(milliseconds(300));
  EXPECT_EQ(script_.opened, 2);
  Run(milliseconds(4300));
  EXPECT_EQ(script_.opened, 2);
  EXPECT_THAT(grabber_.reason(), HasSubstr("no frame for 4"));
}

TEST_F(GrabberTest, OutlivesWhatALibraryThrows) {
  script_.next = []() -> std::optional<Frame> { throw std::bad_alloc(); };
  Run(milliseconds(500));
  EXPECT_EQ(grabber_.state(), Grabber::State::kLost);
  EXPECT_GT(script_.opened, 1);
}

TEST_F(GrabberTest, TriesLessAndLessOftenButNeverGivesUp) {
  script_.next = []() -> std::optional<Frame> { throw SourceError("unplugged"); };
  Run(milliseconds(2000));  // opened at 0, 250, 750, 1750 ms
  EXPECT_EQ(script_.opened, 4);
  EXPECT_EQ(grabber_.reason(), "unplugged");
  const int before = script_.opened;
  Run(milliseconds(60'000));
  EXPECT_NEAR(script_.opened - before, 30, 2);  // every two seconds
  script_.next = [this] { return Fresh(); };
  EXPECT_GT(Run(milliseconds(2100)), 0);
}

TEST_F(GrabberTest, CountsDamagedFramesAndGivesUpASourceOfNothingElse) {
  int turn = 0;
  script_.next = [&]() -> std::optional<Frame> {
    if (++turn % 2 == 0) throw FrameError("damaged");
    return Fresh();
  };
  EXPECT_EQ(Run(milliseconds(3000)), 30);
  const Grabber::Counts counts = grabber_.TakeCounts();
  EXPECT_EQ(counts.received, 30);
  EXPECT_EQ(counts.refused, 30);
  EXPECT_EQ(script_.opened, 1);
  script_.next = []() -> std::optional<Frame> { throw FrameError("damaged"); };
  Run(milliseconds(1500));
  EXPECT_EQ(script_.opened, 2);
}

TEST(Options, AreReadAndChecked) {
  const TempDir folder;
  const auto read = [&](const std::string& text) {
    ConfigFile file(folder.Write("robot.toml", text));
    CameraGrabberOptions options = ReadCameraGrabberOptions(file);
    file.Finish();
    return options;
  };
  EXPECT_EQ(read("[camera_grabber]\nsource = 'folder'\npath = 'frames'\n").playback.path,
            folder.path() / "frames");
  EXPECT_EQ(read("[camera_grabber]\nrate_hz = 7.5\n").device.rate_hz, 7.5);
  EXPECT_THAT(ErrorOf([&] { read("[camera_grabber]\nsource = 'folder'\n"); }), HasSubstr("path"));
  EXPECT_THAT(ErrorOf([&] { read("[camera_grabber]\nsource = 'network'\nurl = 'camera'\n"); }),
              HasSubstr("robot.toml:3"));
  EXPECT_THAT(ErrorOf([&] { read("[camera_grabber]\nsource = 'webcam'\n"); }), HasSubstr("source"));
  EXPECT_THAT(ErrorOf([&] { read("[camera_grabber]\nsorce = 'device'\n"); }), HasSubstr("sorce"));
}

}  // namespace
}  // namespace beckon
