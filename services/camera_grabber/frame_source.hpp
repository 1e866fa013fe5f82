// Where camera frames come from. One class per kind of source stands behind this interface.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/clock.hpp"

namespace beckon {

struct Frame {
  Utime utime = 0;  // of capture
  int width = 0;    // pixels
  int height = 0;
  std::vector<std::uint8_t> jpeg;
};

// The source cannot be had, or went away: it is given up, and a new one opened later.
class SourceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One frame is unusable; the next may be fine.
class FrameError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // The next frame, waited for up to about `timeout`; nothing where there is none yet. Throws
  // FrameError for a frame that is damaged and SourceError when the source is lost.
  virtual std::optional<Frame> Next(std::chrono::milliseconds timeout) = 0;

  // The last frame has been delivered, and none will follow.
  virtual bool ended() const { return false; }
  // Whether silence means that something is wrong. Not for sources that wait on purpose.
  virtual bool is_live() const { return true; }
  // Whether pictures in a row may well be alike to the last byte. A sensor's noise sees to it that
  // they are not; recordings, and video codecs that leave out what has not changed, may.
  virtual bool may_repeat() const { return false; }
  // Frames passed over since the last call, because newer ones had come.
  virtual std::int64_t TakeDropped() { return 0; }
};

// Checks a JPEG file and makes a frame of it. Throws FrameError: "NAME is ...".
Frame FrameFromJpeg(Utime utime, std::vector<std::uint8_t> jpeg, const std::string& name);
// Compresses a picture (CV_8UC3). Throws FrameError: "NAME cannot be ...".
Frame FrameFromImage(Utime utime, const cv::Mat& image, int jpeg_quality, const std::string& name);

}  // namespace beckon
