// What camera_grabber is told to do.
#pragma once

#include <filesystem>
#include <string>

#include "common/config.hpp"

namespace beckon {

struct DeviceOptions {
  std::filesystem::path path = "/dev/video0";
  int width = 640;
  int height = 480;
  double rate_hz = 15.0;  // asked for; the device takes the nearest it knows
  bool lock_exposure = false;
  int exposure = 0;  // in the device's units where locked; 0: what it has just now
  bool lock_white_balance = false;
};

struct PlaybackOptions {
  std::filesystem::path path;
  double rate_hz = 0.0;  // 0: as recorded
  bool loop = false;
  double start_delay_s = 0.0;
};

struct CameraGrabberOptions {
  std::string source = "device";  // device, network, video or folder
  DeviceOptions device;
  std::string url;             // network
  PlaybackOptions playback;    // video, folder
  int jpeg_quality = 85;       // where the source gives no JPEG
  double stall_s = 1.0;        // a live source silent for longer is opened anew
  bool allow_repeats = false;  // of one picture, to the last byte: a camera without noise
};

CameraGrabberOptions ReadCameraGrabberOptions(ConfigFile& file);

}  // namespace beckon
