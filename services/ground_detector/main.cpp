// ground_detector: CAMERA in, GROUND and GROUND_MOTION out. See README.md.
#include <beckon/ground_t.hpp>
#include <beckon/planar_motion_t.hpp>
#include <bot_core/image_t.hpp>
#include <stdexcept>

#include "common/channels.hpp"
#include "common/service.hpp"
#include "services/ground_detector/ground_detector.hpp"
#include "services/ground_detector/jpeg.hpp"
#include "services/ground_detector/messages.hpp"

namespace {

const beckon::ServiceAbout kAbout = {
    "ground_detector",
    "Finds the ground in camera frames (MonoVNS).\n"
    "in:  CAMERA (bot_core.image_t, JPEG), newest only\n"
    "out: GROUND (beckon.ground_t), GROUND_MOTION (beckon.planar_motion_t), one each a frame"};

void Run(beckon::Service& service, const beckon::GroundDetectorOptions& options) {
  beckon::GroundDetector detector(options);
  service.SetHealth(beckon::Health::kWaiting, "no camera frame yet");
  service.bus().SubscribeLatest<bot_core::image_t>(
      beckon::channels::kCamera, [&](const bot_core::image_t& image) {
        if (image.pixelformat != bot_core::image_t::PIXEL_FORMAT_MJPEG) {
          throw std::invalid_argument("frame refused: pixel format is not MJPEG");
        }
        const cv::Mat bgr =
            beckon::DecodeJpeg(image.data, options.camera.width, options.camera.height);
        const beckon::GroundFrame frame = detector.Process(bgr, image.utime);
        service.bus().Publish(beckon::channels::kGround, beckon::MakeGroundMessage(frame));
        service.bus().Publish(beckon::channels::kGroundMotion, beckon::MakeMotionMessage(frame));
        service.SetHealth(beckon::Health::kOk);
      });
  service.Run();
}

}  // namespace

int main(int argc, char** argv) {
  return beckon::RunService(argc, argv, kAbout, beckon::ReadGroundDetectorOptions, Run);
}
