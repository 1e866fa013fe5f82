// A Video4Linux camera that does what the test says. It is an ordinary file, whose ioctl() this
// program answers in the kernel's place, by the V4L2 specification; memory mapping and poll() are
// real.
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <vector>

#include "tests/support/support.hpp"

namespace beckon::testing {

class FakeDevice {
 public:
  FakeDevice();
  ~FakeDevice();
  FakeDevice(const FakeDevice&) = delete;
  FakeDevice& operator=(const FakeDevice&) = delete;

  const std::filesystem::path& path() const { return path_; }

  std::vector<std::uint32_t> formats = {V4L2_PIX_FMT_MJPEG};
  std::uint32_t width = 64;  // the only size that it has
  std::uint32_t height = 48;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  bool unplugged = false;
  std::map<std::uint32_t, int> controls;  // that were set
  double rate_hz = 0.0;                   // that was asked for
  bool is_streaming = false;

  struct Shot {
    std::vector<std::uint8_t> data;
    std::uint32_t flags = 0;
    timeval timestamp{};
  };
  std::deque<Shot> shots;  // taken, and not fetched yet

  // What ioctl() returns; errno through `error`.
  int Answer(unsigned long request, void* argument, int& error);

 private:
  static constexpr std::uint32_t kBufferBytes = 65536;
  TempDir folder_;
  std::filesystem::path path_;
  int file_ = -1;
  std::deque<std::uint32_t> free_buffers_;
};

}  // namespace beckon::testing
