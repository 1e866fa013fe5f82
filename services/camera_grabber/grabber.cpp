#include "services/camera_grabber/grabber.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "common/jpeg.hpp"
#include "common/log.hpp"
#include "services/camera_grabber/device_source.hpp"
#include "services/camera_grabber/folder_source.hpp"
#include "services/camera_grabber/http_source.hpp"
#include "services/camera_grabber/video_source.hpp"

namespace beckon {

Frame FrameFromJpeg(Utime utime, std::vector<std::uint8_t> jpeg, const std::string& name) {
  try {
    const cv::Size size = InspectJpeg(jpeg);
    return {utime, size.width, size.height, std::move(jpeg)};
  } catch (const std::invalid_argument& error) {
    throw FrameError(name + " " + error.what());
  }
}

Frame FrameFromImage(Utime utime, const cv::Mat& image, int jpeg_quality, const std::string& name) {
  try {
    return {utime, image.cols, image.rows, EncodeJpeg(image, jpeg_quality)};
  } catch (const std::exception& error) {  // larger than a JPEG can be, or than memory
    throw FrameError(name + " cannot be made a JPEG: " + error.what());
  }
}

Grabber::Grabber(Open open, const Options& options, const Clock& clock)
    : open_(std::move(open)),
      stall_(UtimeFromSeconds(options.stall_s)),
      allow_repeats_(options.allow_repeats),
      clock_(clock),
      open_at_(clock.Now().steady) {}

std::optional<Frame> Grabber::Next(std::chrono::milliseconds timeout) {
  Instant now = clock_.Now();
  try {
    if (!source_) {
      if (now.steady < open_at_) {
        const std::chrono::microseconds pause = open_at_ - now.steady;
        std::this_thread::sleep_for(std::min<std::chrono::microseconds>(pause, timeout));
        return std::nullopt;
      }
      source_ = open_();
      now = clock_.Now();
      last_frame_ = now.steady;
      patience_ = kFirstFramePatience * stall_;
      is_repeating_ = false;
    }
    std::optional<Frame> frame = source_->Next(timeout);
    now = clock_.Now();
    counts_.dropped += source_->TakeDropped();
    is_repeating_ = frame ? IsRepeated(*frame) : is_repeating_;
    if (is_repeating_ && frame) {
      ++counts_.dropped;
      frame.reset();
    }
    if (frame) {
      ++counts_.received;
      is_refusing_ = false;
      last_jpeg_ = frame->jpeg;
      last_frame_ = now.steady;
      patience_ = stall_;
      state_ = State::kStreaming;
      reason_.clear();
      pause_ = kFirstPause;
    } else if (source_->ended()) {
      state_ = State::kEnded;
      reason_ = "played to the end";
      std::this_thread::sleep_for(timeout);
    } else if (source_->is_live() && now.steady - last_frame_ > patience_) {
      Lose((is_repeating_ ? "the same picture to the last byte for " : "no frame for ") +
               std::to_string((now.steady - last_frame_).count() / 1000) + " ms",
           now);
    }
    return frame;
  } catch (const FrameError& error) {
    ++counts_.refused;
    if (!std::exchange(is_refusing_, true)) LogWarning(error.what());  // the first of a row
    // A source that gives nothing but damage is no better than one that is silent.
    now = clock_.Now();
    if (source_->is_live() && now.steady - last_frame_ > patience_) Lose(error.what(), now);
  } catch (const std::exception& error) {  // SourceError, or what a library makes of its input
    Lose(error.what(), clock_.Now());
  }
  return std::nullopt;
}

bool Grabber::IsRepeated(const Frame& frame) const {
  return !allow_repeats_ && !source_->may_repeat() && frame.jpeg == last_jpeg_;
}

void Grabber::Lose(const std::string& reason, Instant now) {
  source_.reset();
  state_ = State::kLost;
  reason_ = reason;
  open_at_ = now.steady + pause_;
  pause_ = std::min(2 * pause_, kLongestPause);
}

Grabber::Counts Grabber::TakeCounts() { return std::exchange(counts_, {}); }

Grabber::Open OpenerFor(const CameraGrabberOptions& options, const Clock& clock) {
  return [options, &clock]() -> std::unique_ptr<FrameSource> {
    if (options.source == "device")
      return OpenDeviceSource(options.device, options.jpeg_quality, clock);
    if (options.source == "folder")
      return OpenFolderSource(options.playback, options.jpeg_quality, clock);
    if (options.source == "video")
      return OpenVideoFile(options.playback, options.jpeg_quality, clock);
    if (options.url.starts_with("rtsp://"))
      return OpenRtspStream(options.url, options.jpeg_quality, clock);
    return OpenHttpSource(options.url, clock);
  };
}

}  // namespace beckon
