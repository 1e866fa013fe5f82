#include "services/camera_grabber/options.hpp"

namespace beckon {

CameraGrabberOptions ReadCameraGrabberOptions(ConfigFile& file) {
  CameraGrabberOptions options;
  ConfigTable& table = file.Table("camera_grabber");
  table.OptionalChoice("source", options.source, {"device", "network", "video", "folder"});
  table.OptionalPath("device", options.device.path);
  table.Optional("width", options.device.width, Range{16, 16384});
  table.Optional("height", options.device.height, Range{16, 16384});
  table.Optional("lock_exposure", options.device.lock_exposure);
  table.Optional("exposure", options.device.exposure, Range{0, 1e9});
  table.Optional("lock_white_balance", options.device.lock_white_balance);
  table.Optional("url", options.url);
  table.OptionalPath("path", options.playback.path);
  table.Optional("rate_hz", options.playback.rate_hz, Range{0.0, 1000.0});
  if (options.playback.rate_hz > 0.0) options.device.rate_hz = options.playback.rate_hz;
  table.Optional("loop", options.playback.loop);
  table.Optional("start_delay_s", options.playback.start_delay_s, Range{0.0, 3600.0});
  table.Optional("jpeg_quality", options.jpeg_quality, Range{10, 100});
  table.Optional("stall_s", options.stall_s, Range{0.1, 60.0});
  table.Optional("allow_repeats", options.allow_repeats);

  if (options.source == "network") {
    const bool known = options.url.starts_with("http://") || options.url.starts_with("https://") ||
                       options.url.starts_with("rtsp://");
    if (!known) {
      table.Fail("url",
                 "source = \"network\" needs a url that begins with http://, https:// or rtsp://");
    }
  }
  if ((options.source == "video" || options.source == "folder") && options.playback.path.empty()) {
    table.Fail("path", "source = \"" + options.source + "\" needs a path");
  }
  return options;
}

}  // namespace beckon
