#include "tests/camera_grabber/fake_device.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <stdexcept>

namespace beckon::testing {
namespace {

FakeDevice* the_device = nullptr;

bool IsFake(int fd) {
  struct stat found {};
  struct stat fake {};
  return the_device != nullptr && fstat(fd, &found) == 0 &&
         stat(the_device->path().c_str(), &fake) == 0 && found.st_ino == fake.st_ino &&
         found.st_dev == fake.st_dev;
}

}  // namespace

FakeDevice::FakeDevice() : path_(folder_.path() / "video") {
  file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file_ < 0 || ftruncate(file_, 8 * kBufferBytes) != 0) {
    throw std::runtime_error("the fake device cannot be made");
  }
  the_device = this;
}

FakeDevice::~FakeDevice() {
  the_device = nullptr;
  close(file_);
}

int FakeDevice::Answer(unsigned long request, void* argument, int& error) {
  const auto refuse = [&](int code) {
    error = code;
    return -1;
  };
  if (unplugged) return refuse(ENODEV);
  switch (request) {
    case VIDIOC_QUERYCAP:
      static_cast<v4l2_capability*>(argument)->capabilities = capabilities;
      return 0;
    case VIDIOC_S_FMT: {
      // A driver does not refuse what it does not know: it answers with what comes nearest.
      v4l2_pix_format& format = static_cast<v4l2_format*>(argument)->fmt.pix;
      bool is_known = false;
      for (const std::uint32_t known : formats) is_known = is_known || known == format.pixelformat;
      if (!is_known) format.pixelformat = formats.front();
      format.width = width;
      format.height = height;
      format.bytesperline = format.pixelformat == V4L2_PIX_FMT_YUYV ? 2 * width : 0;
      return 0;
    }
    case VIDIOC_S_PARM: {
      const v4l2_fract& period = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
      rate_hz = static_cast<double>(period.denominator) / period.numerator;
      return 0;
    }
    case VIDIOC_S_CTRL: {
      const auto* control = static_cast<v4l2_control*>(argument);
      controls[control->id] = control->value;
      return 0;
    }
    case VIDIOC_REQBUFS:
      return 0;  // as many as asked for
    case VIDIOC_QUERYBUF: {
      auto* buffer = static_cast<v4l2_buffer*>(argument);
      buffer->length = kBufferBytes;
      buffer->m.offset = buffer->index * kBufferBytes;
      return 0;
    }
    case VIDIOC_QBUF:
      free_buffers_.push_back(static_cast<v4l2_buffer*>(argument)->index);
      return 0;
    case VIDIOC_DQBUF: {
      if (shots.empty() || free_buffers_.empty()) return refuse(EAGAIN);
      auto* buffer = static_cast<v4l2_buffer*>(argument);
      const Shot shot = shots.front();
      shots.pop_front();
      buffer->index = free_buffers_.front();
      free_buffers_.pop_front();
      buffer->bytesused = static_cast<std::uint32_t>(shot.data.size());
      buffer->flags = shot.flags;
      buffer->timestamp = shot.timestamp;
      const auto written = pwrite(file_, shot.data.data(), shot.data.size(),
                                  static_cast<off_t>(buffer->index) * kBufferBytes);
      return written == static_cast<ssize_t>(shot.data.size()) ? 0 : refuse(EIO);
    }
    case VIDIOC_STREAMON:
      is_streaming = true;
      return 0;
    case VIDIOC_STREAMOFF:
      is_streaming = false;
      return 0;
    default:
      return refuse(ENOTTY);
  }
}

}  // namespace beckon::testing

// In the place of libc's, for this whole program.
extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  if (!beckon::testing::IsFake(fd)) {
    return static_cast<int>(syscall(SYS_ioctl, fd, request, argument));
  }
  int error = 0;
  const int result = beckon::testing::the_device->Answer(request, argument, error);
  if (result < 0) errno = error;
  return result;
}
