// camera_grabber: frames from a camera, a network stream, a video file or a folder onto CAMERA.
#include <thread>
#include <utility>

#include "bot_core/image_t.hpp"
#include "common/channels.hpp"
#include "common/service.hpp"
#include "services/camera_grabber/grabber.hpp"
#include "services/camera_grabber/options.hpp"

namespace beckon {
namespace {

constexpr std::chrono::milliseconds kWait{100};
constexpr std::size_t kDatagramBytes =
    64'000;  // larger messages are sent in fragments, and lost with any of them

bot_core::image_t MessageFromFrame(Frame frame) {
  bot_core::image_t message{};
  message.utime = frame.utime;
  message.width = frame.width;
  message.height = frame.height;
  message.pixelformat = bot_core::image_t::PIXEL_FORMAT_MJPEG;
  message.size = static_cast<std::int32_t>(frame.jpeg.size());
  message.data = std::move(frame.jpeg);
  return message;
}

void ReportHealth(Service& service, const Grabber& grabber) {
  switch (grabber.state()) {
    case Grabber::State::kStreaming:
      return service.SetHealth(Health::kOk);
    case Grabber::State::kLost:
      return service.SetHealth(Health::kFailed, grabber.reason());
    case Grabber::State::kOpening:
    case Grabber::State::kEnded:
      return service.SetHealth(Health::kWaiting, grabber.reason());
  }
}

void Run(Service& service, const CameraGrabberOptions& options) {
  // Cameras block: they get a thread of their own, so that HEALTH goes on.
  std::jthread capture([&](const std::stop_token& token) {
    Grabber grabber(OpenerFor(options, service.clock()), {options.stall_s, options.allow_repeats},
                    service.clock());
    bool warned = false;
    while (!token.stop_requested() && !service.stopping()) {
      std::optional<Frame> frame = grabber.Next(kWait);
      ReportHealth(service, grabber);
      const Grabber::Counts counts = grabber.TakeCounts();
      service.CountInput(counts.received, counts.refused, counts.dropped);
      if (!frame) continue;
      if (frame->jpeg.size() > kDatagramBytes && !std::exchange(warned, true)) {
        LogWarning("frames of " + std::to_string(frame->jpeg.size()) +
                   " bytes do not fit one datagram: a lower resolution or quality loses fewer");
      }
      service.bus().Publish(channels::kCamera, MessageFromFrame(std::move(*frame)));
    }
  });
  service.Run();
}

}  // namespace
}  // namespace beckon

int main(int argc, char** argv) {
  return beckon::RunService(
      argc, argv,
      {"camera_grabber",
       "Takes frames from a camera device, a network stream, a video file or a folder.\n"
       "In: nothing. Out: CAMERA (JPEG), HEALTH."},
      beckon::ReadCameraGrabberOptions, beckon::Run);
}
