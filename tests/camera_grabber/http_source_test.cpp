#include "services/camera_grabber/http_source.hpp"

#include <gmock/gmock.h>

#include "services/camera_grabber/grabber.hpp"
#include "tests/camera_grabber/stream_server.hpp"
#include "tests/camera_grabber/test_frames.hpp"

namespace beckon {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using testing::Part;
using testing::StreamServer;
using testing::TestJpeg;
using testing::TestJpegText;

const SystemClock kClock;

std::string Timestamp(double seconds_ago) {
  char header[64];
  std::snprintf(header, sizeof(header), "X-Timestamp: %.6f\r\n",
                SecondsFromUtime(kClock.Now().utime) - seconds_ago);
  return header;
}

// The next frame or error within ten seconds.
std::optional<Frame> NextFrame(FrameSource& source) {
  for (int i = 0; i < 100; ++i) {
    if (auto frame = source.Next(milliseconds(100))) return frame;
  }
  return std::nullopt;
}

std::string SourceErrorOf(FrameSource& source) {
  try {
    NextFrame(source);
  } catch (const SourceError& error) {
    return error.what();
  }
  return "no error";
}

TEST(CaptureTime, BelievesAClockThatAgreesAndNoOther) {
  constexpr Utime kArrival = 1'700'000'010'000'000;
  EXPECT_EQ(CaptureTime("1700000009.750000", kArrival), 1'700'000'009'750'000);
  EXPECT_EQ(CaptureTime("1700000010.5", kArrival), 1'700'000'010'500'000);
  for (const char* bad :
       {"", "nan", "inf", "1700000000.0", "1700000013", "0", "-5", "soon", "1700000009.7x"}) {
    EXPECT_EQ(CaptureTime(bad, kArrival), kArrival) << bad;
  }
}

TEST(HttpUrl, IsSplitIntoHostAndPath) {
  EXPECT_EQ(ParseHttpUrl("http://camera:81/a/b?c=d").origin, "http://camera:81");
  EXPECT_EQ(ParseHttpUrl("http://camera:81/a/b?c=d").path, "/a/b?c=d");
  EXPECT_EQ(ParseHttpUrl("https://camera").path, "/");
  EXPECT_THROW(ParseHttpUrl("ftp://camera"), SourceError);
  EXPECT_THROW(ParseHttpUrl("http://"), SourceError);
}

TEST(HttpSource, PassesFramesThroughUntouchedWithTheirTime) {
  const auto jpeg = TestJpegText();
  StreamServer server([&](StreamServer::Client& client, int) {
    client.Send(StreamServer::kHeader + Part(jpeg, "X-Timestamp: 12.0\r\n"));
    client.Wait();
  });
  const auto source = OpenHttpSource(server.url(), kClock);
  const auto frame = NextFrame(*source);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->jpeg, TestJpeg());
  EXPECT_EQ(frame->width, 64);
  EXPECT_EQ(frame->height, 48);
  EXPECT_LT(std::abs(frame->utime - kClock.Now().utime), 60'000'000);  // 12.0 is not believed

  const std::string header = Timestamp(0.4);
  StreamServer dated([&](StreamServer::Client& client, int) {
    client.Send(StreamServer::kHeader + Part(jpeg, header));
    client.Wait();
  });
  const auto dated_frame = NextFrame(*OpenHttpSource(dated.url(), kClock));
  ASSERT_TRUE(dated_frame);
  EXPECT_EQ(dated_frame->utime, CaptureTime(header.substr(13, 17), kClock.Now().utime));
}

TEST(HttpSource, GivesTheNewestFrameAndCountsTheOthers) {
  std::atomic<bool> all_sent = false;
  StreamServer server([&](StreamServer::Client& client, int) {
    client.Send(StreamServer::kHeader);
    for (int i = 0; i < 5; ++i) client.Send(Part(TestJpegText(16 * (i + 1), 16)));
    all_sent = true;
    client.Wait();
  });
  const auto source = OpenHttpSource(server.url(), kClock);
  while (!all_sent) std::this_thread::sleep_for(milliseconds(5));
  std::this_thread::sleep_for(
      milliseconds(200));  // for the last bytes to be read in the background
  std::int64_t frames = 0;
  int last_width = 0;
  while (const auto frame = source->Next(milliseconds(200))) {
    ++frames;
    last_width = frame->width;
  }
  EXPECT_EQ(last_width, 80);
  EXPECT_EQ(frames + source->TakeDropped(), 5);
}

TEST(HttpSource, RefusesDamagedFramesAndGoesOn) {
  std::string cut = TestJpegText();
  cut.resize(cut.size() / 2);
  std::atomic<int> step = 0;
  StreamServer server([&](StreamServer::Client& client, int) {
    client.Send(StreamServer::kHeader);
    for (const std::string& body : {cut, std::string("garbage"), TestJpegText()}) {
      const int now = step;
      client.Send(Part(body));
      while (step == now && !client.ending()) std::this_thread::sleep_for(milliseconds(5));
    }
  });
  const auto source = OpenHttpSource(server.url(), kClock);
  const auto error = [&]() -> std::string {
    try {
      NextFrame(*source);
    } catch (const FrameError& refusal) {
      return refusal.what();
    }
    return "no error";
  };
  EXPECT_THAT(error(), HasSubstr("cut short"));
  ++step;
  EXPECT_THAT(error(), HasSubstr("does not begin like a JPEG"));
  ++step;
  EXPECT_TRUE(NextFrame(*source));
  ++step;
}

TEST(HttpSource, SaysWhyThereIsNoStream) {
  {
    StreamServer html([](StreamServer::Client& client, int) {
      client.Send("HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: 2\r\n\r\nhi");
    });
    EXPECT_THAT(SourceErrorOf(*OpenHttpSource(html.url(), kClock)), HasSubstr("text/html"));
  }
  {
    StreamServer missing([](StreamServer::Client& client, int) {
      client.Send("HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n");
    });
    EXPECT_THAT(SourceErrorOf(*OpenHttpSource(missing.url(), kClock)), HasSubstr("404"));
  }
  {
    StreamServer garbage(
        [](StreamServer::Client& client, int) { client.Send("\x01\x02 not HTTP\r\n\r\n"); });
    EXPECT_THAT(SourceErrorOf(*OpenHttpSource(garbage.url(), kClock)), HasSubstr(garbage.url()));
  }
  {
    StreamServer ends(
        [](StreamServer::Client& client, int) { client.Send(StreamServer::kHeader); });
    EXPECT_THAT(SourceErrorOf(*OpenHttpSource(ends.url(), kClock)), HasSubstr("ended"));
  }
  int port = 0;
  {
    StreamServer gone([](StreamServer::Client&, int) {});
    port = gone.port();
  }
  EXPECT_THAT(SourceErrorOf(*OpenHttpSource("http://127.0.0.1:" + std::to_string(port), kClock)),
              HasSubstr("no connection"));
}

TEST(Grabber, OpensAStalledStreamAnew) {
  const auto jpeg = TestJpegText();
  StreamServer server([&](StreamServer::Client& client, int connection) {
    if (connection == 0) {  // one frame, then silence
      client.Send(StreamServer::kHeader + Part(jpeg));
      client.Wait();
    } else if (connection == 1) {  // bytes without end, but never a frame
      client.Send(StreamServer::kHeader);
      while (client.Send("noise ")) std::this_thread::sleep_for(milliseconds(5));
    } else {
      client.Send(StreamServer::kHeader);
      for (int i = 0; client.Send(Part(TestJpegText(64, 48, i % 200))); ++i) {
        std::this_thread::sleep_for(milliseconds(20));
      }
    }
  });
  CameraGrabberOptions options;
  options.source = "network";
  options.url = server.url();
  options.stall_s = 0.3;
  Grabber grabber(OpenerFor(options, kClock), {.stall_s = options.stall_s}, kClock);
  int frames = 0;
  bool was_lost = false;
  for (int i = 0; i < 500 && frames < 4; ++i) {
    frames += grabber.Next(milliseconds(50)).has_value();
    if (grabber.state() == Grabber::State::kLost && grabber.reason().find("no frame for") == 0)
      was_lost = true;
  }
  EXPECT_EQ(frames, 4);
  EXPECT_TRUE(was_lost);
  EXPECT_EQ(server.connections(), 3);
  EXPECT_EQ(grabber.state(), Grabber::State::kStreaming);
}

}  // namespace
}  // namespace beckon
