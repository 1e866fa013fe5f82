// RTSP against a camera that sends RTP/JPEG (RFC 2326, RFC 2435) interleaved on its TCP connection.
#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "services/camera_grabber/grabber.hpp"
#include "tests/camera_grabber/stream_server.hpp"
#include "tests/camera_grabber/test_frames.hpp"

namespace beckon {
namespace {

using std::chrono::milliseconds;
using testing::StreamServer;

// The part of a baseline JPEG that RTP/JPEG carries.
struct JpegParts {
  std::string quantization;  // two tables of 64
  std::string scan;
};
JpegParts Parse(const std::string& jpeg) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(jpeg.at(at)); };
  JpegParts parts;
  std::size_t at = 2;
  for (;;) {
    const unsigned char marker = byte(at + 1);
    const std::size_t length = byte(at + 2) * 256U + byte(at + 3);
    if (marker == 0xdb) {
      for (std::size_t table = at + 4; table < at + 2 + length; table += 65)
        parts.quantization += jpeg.substr(table + 1, 64);
    }
    at += 2 + length;
    if (marker == 0xda) break;
  }
  parts.scan = jpeg.substr(at, jpeg.size() - 2 - at);
  return parts;
}

std::string BigEndian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i) & 0xffU);
  return text;
}

// One frame of 64 x 48 pixels as one interleaved RTP packet.
std::string Packet(int number, int brightness) {
  const JpegParts parts = Parse(testing::TestJpegText(64, 48, brightness));
  std::string packet = "\x80";
  packet += static_cast<char>(0x80 | 26);  // the last packet of its frame; payload type JPEG
  packet += BigEndian(static_cast<std::uint32_t>(number), 2);
  packet += BigEndian(static_cast<std::uint32_t>(number) * 90'000 / 25, 4);
  packet += BigEndian(0x42, 4);
  packet += BigEndian(0, 4);  // offset of this fragment in the frame
  packet += '\x01';           // chroma halved in both directions
  packet += '\xff';           // tables follow
  packet += static_cast<char>(64 / 8);
  packet += static_cast<char>(48 / 8);
  packet += BigEndian(0, 2) + BigEndian(128, 2) + parts.quantization + parts.scan;
  return std::string("$") + '\0' + BigEndian(static_cast<std::uint32_t>(packet.size()), 2) + packet;
}

// Answers the dialogue up to PLAY. False where the client leaves before.
bool Introduce(StreamServer::Client& client, const std::string& url) {
  for (std::string request = client.first_request(); !request.empty();
       request = client.NextRequest()) {
    const auto number = request.find("CSeq:");
    if (number == std::string::npos) return false;
    std::string answer =
        "RTSP/1.0 200 OK\r\n" + request.substr(number, request.find("\r\n", number) + 2 - number);
    if (request.starts_with("OPTIONS")) {
      answer += "Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN\r\n\r\n";
    } else if (request.starts_with("DESCRIBE")) {
      const std::string description =
          "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=camera\r\nc=IN IP4 0.0.0.0\r\nt=0 0\r\n"
          "m=video 0 RTP/AVP 26\r\na=framerate:25\r\na=control:" +
          url + "/track\r\n";
      answer +=
          "Content-Type: application/sdp\r\nContent-Length: " + std::to_string(description.size()) +
          "\r\n\r\n" + description;
    } else if (request.starts_with("SETUP")) {
      answer += "Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\nSession: 1\r\n\r\n";
    } else {
      answer += "Session: 1\r\n\r\n";
    }
    if (!client.Send(answer)) return false;
    if (request.starts_with("PLAY")) return true;
  }
  return false;
}

TEST(RtspStream, FramesComeAndAStalledStreamIsOpenedAnew) {
  const SystemClock clock;
  std::string url;
  StreamServer server([&](StreamServer::Client& client, int connection) {
    if (!Introduce(client, url)) return;
    // The first connection falls silent; the second goes on.
    for (int i = 0; connection > 0 || i < 60; ++i) {
      if (!client.Send(Packet(i, 60 + 80 * std::min(connection, 1)))) return;
      std::this_thread::sleep_for(milliseconds(10));
    }
    client.Wait();
  });
  url = "rtsp://127.0.0.1:" + std::to_string(server.port()) + "/camera";
  CameraGrabberOptions options;
  options.source = "network";
  options.url = url;
  Grabber grabber(OpenerFor(options, clock), {.stall_s = options.stall_s}, clock);
  std::vector<int> brightness;
  bool was_lost = false;
  for (int i = 0; i < 1500 && (brightness.empty() || brightness.back() < 100); ++i) {
    const auto frame = grabber.Next(milliseconds(20));
    was_lost = was_lost || (grabber.state() == Grabber::State::kLost && !brightness.empty());
    if (!frame) continue;
    const cv::Mat image = cv::imdecode(frame->jpeg, cv::IMREAD_GRAYSCALE);
    ASSERT_EQ(image.size(), cv::Size(64, 48));
    brightness.push_back(static_cast<int>(cv::mean(image)[0]));
  }
  ASSERT_GT(brightness.size(), 1U) << grabber.reason();
  EXPECT_NEAR(brightness.front(), 60, 3);
  EXPECT_NEAR(brightness.back(), 140, 3);
  EXPECT_TRUE(was_lost);
  EXPECT_GE(server.connections(), 1);
}

}  // namespace
}  // namespace beckon
