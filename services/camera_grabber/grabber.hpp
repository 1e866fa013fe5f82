// Keeps a source of frames open: notices silence and frozen pictures, opens it anew with back-off,
// refuses damaged frames.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/camera_grabber/frame_source.hpp"
#include "services/camera_grabber/options.hpp"

namespace beckon {

class Grabber {
 public:
  enum class State {
    kOpening,  // no frame yet since the start
    kStreaming,
    kLost,   // given up and opened again after a pause, until there is a frame
    kEnded,  // played to the end
  };
  struct Counts {
    std::int64_t received = 0;
    std::int64_t refused = 0;  // damaged frames
    std::int64_t dropped = 0;
  };
  using Open = std::function<std::unique_ptr<FrameSource>()>;

  struct Options {
    double stall_s = 1.0;        // a live source without a usable frame for longer is opened anew
    bool allow_repeats = false;  // pictures that are alike to the last byte are all passed on
  };

  // `open` makes the source, or throws SourceError.
  Grabber(Open open, const Options& options, const Clock& clock);

  // The next frame, waited for up to about `timeout`. A picture that is the last one again, to the
  // last byte, from a source that cannot repeat itself is none. Never throws for what the source
  // does.
  std::optional<Frame> Next(std::chrono::milliseconds timeout);

  State state() const { return state_; }
  const std::string& reason() const { return reason_; }  // why it is not streaming
  Counts TakeCounts();

  static constexpr std::chrono::milliseconds kFirstPause{250};
  static constexpr std::chrono::milliseconds kLongestPause{2000};
  // Cameras take a while from being opened to their first frame: times stall_s.
  static constexpr int kFirstFramePatience = 4;

 private:
  bool IsRepeated(const Frame& frame) const;
  void Lose(const std::string& reason, Instant now);

  const Open open_;
  const std::chrono::microseconds stall_;
  const bool allow_repeats_;
  const Clock& clock_;
  std::unique_ptr<FrameSource> source_;
  State state_ = State::kOpening;
  std::string reason_ = "no frame yet";
  std::chrono::milliseconds pause_ = kFirstPause;
  std::chrono::microseconds open_at_{};
  std::chrono::microseconds last_frame_{};  // or when the source was opened
  std::chrono::microseconds patience_{};    // with silence since then
  Counts counts_;
  bool is_refusing_ = false;
  bool is_repeating_ = false;
  std::vector<std::uint8_t> last_jpeg_;  // kept while the source is opened anew
};

// The source that the options name.
Grabber::Open OpenerFor(const CameraGrabberOptions& options, const Clock& clock);

}  // namespace beckon
