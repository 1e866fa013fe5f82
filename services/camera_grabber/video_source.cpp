#include "services/camera_grabber/video_source.hpp"

#include <cmath>
#include <filesystem>
#include <opencv2/videoio.hpp>

#include "services/camera_grabber/pacer.hpp"

namespace beckon {
namespace {

constexpr int kOpenTimeoutMs = 2000;
constexpr int kReadTimeoutMs = 1000;
constexpr double kUsualRateHz = 25.0;

class VideoFile : public FrameSource {
 public:
  VideoFile(const PlaybackOptions& options, int jpeg_quality, const Clock& clock)
      : options_(options),
        jpeg_quality_(jpeg_quality),
        clock_(clock),
        capture_(Open(options)),
        pacer_(RateOf(options, capture_), options.start_delay_s, clock) {}

  std::optional<Frame> Next(std::chrono::milliseconds timeout) override {
    if (ended_ || !pacer_.Wait(timeout)) return std::nullopt;
    cv::Mat image;
    if (!capture_.read(image) && options_.loop && frames_ > 0) {
      capture_ = Open(options_);
      capture_.read(image);
    }
    if (image.empty()) {
      if (frames_ == 0)
        throw SourceError(options_.path.string() + " holds no frame that can be decoded");
      ended_ = true;
      return std::nullopt;
    }
    ++frames_;
    return FrameFromImage(clock_.Now().utime, image, jpeg_quality_,
                          "a frame of " + options_.path.string());
  }

  bool ended() const override { return ended_; }
  bool is_live() const override { return false; }
  bool may_repeat() const override { return true; }

 private:
  static cv::VideoCapture Open(const PlaybackOptions& options) {
    if (!std::filesystem::is_regular_file(options.path)) {
      throw SourceError(options.path.string() + " is not there");
    }
    cv::VideoCapture capture(options.path.string(), cv::CAP_FFMPEG);
    if (!capture.isOpened())
      throw SourceError(options.path.string() + " is not a video that can be opened");
    return capture;
  }

  static double RateOf(const PlaybackOptions& options, const cv::VideoCapture& capture) {
    if (options.rate_hz > 0.0) return options.rate_hz;
    const double rate_hz = capture.get(cv::CAP_PROP_FPS);
    return std::isfinite(rate_hz) && rate_hz > 0.01 && rate_hz < 1000.0 ? rate_hz : kUsualRateHz;
  }

  const PlaybackOptions options_;
  const int jpeg_quality_;
  const Clock& clock_;
  cv::VideoCapture capture_;
  Pacer pacer_;
  std::int64_t frames_ = 0;
  bool ended_ = false;
};

class RtspStream : public FrameSource {
 public:
  RtspStream(const std::string& url, int jpeg_quality, const Clock& clock)
      : url_(url), jpeg_quality_(jpeg_quality), clock_(clock) {
    const bool opened = capture_.open(url, cv::CAP_FFMPEG,
                                      {cv::CAP_PROP_OPEN_TIMEOUT_MSEC, kOpenTimeoutMs,
                                       cv::CAP_PROP_READ_TIMEOUT_MSEC, kReadTimeoutMs});
    if (!opened) throw SourceError("no stream to be had from " + url);
  }

  std::optional<Frame> Next(std::chrono::milliseconds) override {
    cv::Mat image;
    if (!capture_.read(image) || image.empty())
      throw SourceError("the stream from " + url_ + " broke off or stalled");
    return FrameFromImage(clock_.Now().utime, image, jpeg_quality_, "a frame from " + url_);
  }

  bool may_repeat() const override { return true; }

 private:
  const std::string url_;
  const int jpeg_quality_;
  const Clock& clock_;
  cv::VideoCapture capture_;
};

}  // namespace

std::unique_ptr<FrameSource> OpenVideoFile(const PlaybackOptions& options, int jpeg_quality,
                                           const Clock& clock) {
  return std::make_unique<VideoFile>(options, jpeg_quality, clock);
}

std::unique_ptr<FrameSource> OpenRtspStream(const std::string& url, int jpeg_quality,
                                            const Clock& clock) {
  return std::make_unique<RtspStream>(url, jpeg_quality, clock);
}

}  // namespace beckon
