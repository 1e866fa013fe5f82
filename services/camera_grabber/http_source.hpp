// A network camera that sends MJPEG over HTTP.
#pragma once

#include <memory>
#include <string>

#include "services/camera_grabber/frame_source.hpp"

namespace beckon {

// Frames pass through untouched. The time of capture is the part's X-Timestamp (seconds since the
// Unix epoch) where it is there and within kMaxClockDifference of the arrival, else the arrival.
// Always the newest frame: what nobody fetched in time is dropped and counted.
//
// Connecting happens in the background; SourceError comes from Next().
std::unique_ptr<FrameSource> OpenHttpSource(const std::string& url, const Clock& clock);

inline constexpr std::chrono::seconds kMaxClockDifference{2};

// The parts of http[s]://host[:port]/path; throws SourceError for anything else.
struct HttpUrl {
  std::string origin;  // http[s]://host:port
  std::string path;    // with the query
};
HttpUrl ParseHttpUrl(const std::string& url);

// Capture time for a part that arrived at `arrival` with this X-Timestamp (empty: none).
Utime CaptureTime(const std::string& timestamp, Utime arrival);

}  // namespace beckon
