// What OpenCV can open: video files and RTSP streams. Frames are compressed again.
#pragma once

#include <memory>
#include <string>

#include "services/camera_grabber/frame_source.hpp"
#include "services/camera_grabber/options.hpp"

namespace beckon {

// Plays the file at options.rate_hz, else at its own rate; no frame is left out. Throws
// SourceError.
std::unique_ptr<FrameSource> OpenVideoFile(const PlaybackOptions& options, int jpeg_quality,
                                           const Clock& clock);

// Dates frames by their arrival. Opening and each read give up after a second or two. Throws
// SourceError.
std::unique_ptr<FrameSource> OpenRtspStream(const std::string& url, int jpeg_quality,
                                            const Clock& clock);

}  // namespace beckon
