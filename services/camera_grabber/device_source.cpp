#include "services/camera_grabber/device_source.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "common/log.hpp"

namespace beckon {
namespace {

constexpr std::uint32_t kBuffers = 4;

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) close(fd_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

// A driver's buffer in this process's memory.
class Mapping {
 public:
  Mapping(int fd, const v4l2_buffer& buffer)
      : size_(buffer.length),
        data_(mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_SHARED, fd, buffer.m.offset)) {}
  ~Mapping() {
    if (is_mapped()) munmap(data_, size_);
  }
  Mapping(Mapping&& other) noexcept
      : size_(other.size_), data_(std::exchange(other.data_, MAP_FAILED)) {}
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  Mapping& operator=(Mapping&&) = delete;
  bool is_mapped() const { return data_ != MAP_FAILED; }
  const std::uint8_t* data() const { return static_cast<const std::uint8_t*>(data_); }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_;
  void* data_;
};

class DeviceSource : public FrameSource {
 public:
  DeviceSource(const DeviceOptions& options, int jpeg_quality, const Clock& clock)
      : options_(options),
        jpeg_quality_(jpeg_quality),
        clock_(clock),
        file_(open(options.path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
    if (file_.get() < 0) Fail("cannot be opened");
    CheckCapabilities();
    SetFormat();
    SetRate();
    LockControls();
    MapBuffers();
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    Demand(VIDIOC_STREAMON, &type, "does not start streaming");
  }

  ~DeviceSource() override {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    Control(VIDIOC_STREAMOFF, &type);
  }

  std::optional<Frame> Next(std::chrono::milliseconds timeout) override {
    pollfd waiting{file_.get(), POLLIN, 0};
    if (poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) return std::nullopt;
    std::optional<v4l2_buffer> newest;
    while (const auto buffer = Dequeue()) {
      if (newest) {
        ++dropped_;
        Enqueue(*newest);
      }
      newest = buffer;
    }
    if (!newest) {
      if ((waiting.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
        throw SourceError(Name() + " went away");
      }
      return std::nullopt;
    }
    const v4l2_buffer buffer = *newest;
    const Utime utime = CaptureTimeOf(buffer);
    std::vector<std::uint8_t> data;
    if (buffer.index < mappings_.size()) {
      const Mapping& mapping = mappings_[buffer.index];
      data.assign(mapping.data(),
                  mapping.data() + std::min<std::size_t>(buffer.bytesused, mapping.size()));
    }
    Enqueue(buffer);
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0)
      throw FrameError(Name() + " reports a damaged frame");
    return pixel_format_ == V4L2_PIX_FMT_YUYV
               ? Compress(utime, std::move(data))
               : FrameFromJpeg(utime, std::move(data), "a frame from " + Name());
  }

  std::int64_t TakeDropped() override { return std::exchange(dropped_, 0); }

 private:
  std::string Name() const { return options_.path.string(); }

  [[noreturn]] void Fail(const std::string& what) const {
    throw SourceError(Name() + " " + what + ": " + std::strerror(errno));
  }

  template <typename Argument>
  bool Control(unsigned long request,
               Argument* argument) const {  // NOLINT(google-runtime-int): ioctl's own type
    int result = 0;
    do {
      result = ioctl(file_.get(), request, argument);
    } while (result < 0 && errno == EINTR);
    return result == 0;
  }
  template <typename Argument>
  void Demand(unsigned long request, Argument* argument,
              const std::string& otherwise) const {  // NOLINT
    if (!Control(request, argument)) Fail(otherwise);
  }

  void CheckCapabilities() const {
    v4l2_capability capability{};
    Demand(VIDIOC_QUERYCAP, &capability, "is not a camera");
    const std::uint32_t able = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                   ? capability.device_caps
                                   : capability.capabilities;
    if ((able & V4L2_CAP_VIDEO_CAPTURE) == 0 || (able & V4L2_CAP_STREAMING) == 0) {
      throw SourceError(Name() +
                        " does not stream video (another /dev/video* of the same camera may)");
    }
  }

  void SetFormat() {
    for (const std::uint32_t wanted : {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_JPEG, V4L2_PIX_FMT_YUYV}) {
      v4l2_format format{};
      format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      format.fmt.pix.width = static_cast<std::uint32_t>(options_.width);
      format.fmt.pix.height = static_cast<std::uint32_t>(options_.height);
      format.fmt.pix.pixelformat = wanted;
      format.fmt.pix.field = V4L2_FIELD_ANY;
      if (!Control(VIDIOC_S_FMT, &format) || format.fmt.pix.pixelformat != wanted) continue;
      pixel_format_ = wanted;
      width_ = static_cast<int>(format.fmt.pix.width);
      height_ = static_cast<int>(format.fmt.pix.height);
      bytes_per_line_ = format.fmt.pix.bytesperline;
      if (width_ != options_.width || height_ != options_.height) {
        throw SourceError(Name() + " gives " + std::to_string(width_) + " x " +
                          std::to_string(height_) + " instead of " +
                          std::to_string(options_.width) + " x " + std::to_string(options_.height) +
                          ": set width and height so, and calibrate for it");
      }
      return;
    }
    throw SourceError(Name() + " gives neither MJPEG nor YUYV");
  }

  void SetRate() const {
    v4l2_streamparm parameters{};
    parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    parameters.parm.capture.timeperframe = {
        1000, static_cast<std::uint32_t>(std::lround(1000.0 * options_.rate_hz))};
    if (!Control(VIDIOC_S_PARM, &parameters)) LogWarning(Name() + " does not let its rate be set");
  }

  void SetControl(std::uint32_t id, int value, const std::string& what) const {
    v4l2_control control{id, value};
    if (!Control(VIDIOC_S_CTRL, &control)) {
      LogWarning(Name() + " does not let its " + what + " be set: " + std::strerror(errno));
    }
  }

  void LockControls() const {
    if (options_.lock_exposure) {
      SetControl(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "automatic exposure");
      if (options_.exposure > 0)
        SetControl(V4L2_CID_EXPOSURE_ABSOLUTE, options_.exposure, "exposure");
    }
    if (options_.lock_white_balance) SetControl(V4L2_CID_AUTO_WHITE_BALANCE, 0, "white balance");
  }

  void MapBuffers() {
    v4l2_requestbuffers request{};
    request.count = kBuffers;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    Demand(VIDIOC_REQBUFS, &request, "gives no buffers");
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer{};
      buffer.type = request.type;
      buffer.memory = request.memory;
      buffer.index = i;
      Demand(VIDIOC_QUERYBUF, &buffer, "does not describe its buffers");
      mappings_.emplace_back(file_.get(), buffer);
      if (!mappings_.back().is_mapped()) Fail("does not let its buffers be mapped");
      Enqueue(buffer);
    }
    if (mappings_.empty()) throw SourceError(Name() + " gives no buffers");
  }

  std::optional<v4l2_buffer> Dequeue() const {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (Control(VIDIOC_DQBUF, &buffer)) return buffer;
    if (errno == EAGAIN) return std::nullopt;
    Fail("went away");
  }

  void Enqueue(v4l2_buffer buffer) const {
    Demand(VIDIOC_QBUF, &buffer, "does not take its buffer back");
  }

  Utime CaptureTimeOf(const v4l2_buffer& buffer) const {
    const Utime now = clock_.Now().utime;
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
      return now;
    timespec steady{};
    clock_gettime(CLOCK_MONOTONIC, &steady);
    const Utime age = (static_cast<Utime>(steady.tv_sec) - buffer.timestamp.tv_sec) * 1'000'000 +
                      steady.tv_nsec / 1000 - buffer.timestamp.tv_usec;
    return age >= 0 && age < 1'000'000 ? now - age : now;
  }

  Frame Compress(Utime utime, std::vector<std::uint8_t> yuyv) const {
    const std::size_t stride =
        std::max<std::size_t>(bytes_per_line_, 2 * static_cast<std::size_t>(width_));
    if (yuyv.size() < stride * static_cast<std::size_t>(height_)) {
      throw FrameError("a frame from " + Name() + " is cut short after " +
                       std::to_string(yuyv.size()) + " bytes");
    }
    cv::Mat image;
    cv::cvtColor(cv::Mat(height_, width_, CV_8UC2, yuyv.data(), stride), image,
                 cv::COLOR_YUV2BGR_YUYV);
    return FrameFromImage(utime, image, jpeg_quality_, "a frame from " + Name());
  }

  const DeviceOptions options_;
  const int jpeg_quality_;
  const Clock& clock_;
  const FileDescriptor file_;
  std::uint32_t pixel_format_ = 0;
  int width_ = 0;
  int height_ = 0;
  std::size_t bytes_per_line_ = 0;
  std::vector<Mapping> mappings_;
  std::int64_t dropped_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> OpenDeviceSource(const DeviceOptions& options, int jpeg_quality,
                                              const Clock& clock) {
  return std::make_unique<DeviceSource>(options, jpeg_quality, clock);
}

}  // namespace beckon
