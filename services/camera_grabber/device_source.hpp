// A camera behind a Video4Linux device.
#pragma once

#include <memory>

#include "services/camera_grabber/frame_source.hpp"
#include "services/camera_grabber/options.hpp"

namespace beckon {

// Streams from mapped buffers: MJPEG passes through untouched, YUYV is compressed. Frames are dated
// by the driver where it uses the steady clock, else by their arrival. Always the newest frame;
// older ones in the queue are counted as dropped. Throws SourceError, with what the device is
// missing.
std::unique_ptr<FrameSource> OpenDeviceSource(const DeviceOptions& options, int jpeg_quality,
                                              const Clock& clock);

}  // namespace beckon
