// A network camera: frames as MJPEG over HTTP, as thousands of cameras serve them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/clock.hpp"

namespace beckon::simulation {

// Serves http://127.0.0.1:PORT/stream as multipart/x-mixed-replace, one part per frame with the
// headers Content-Type, Content-Length and X-Timestamp (seconds.microseconds since the Unix epoch,
// of capture). Every client gets each frame at most once, and the newest when it is slow.
class CameraServer {
 public:
  // Throws std::runtime_error when the port cannot be had. Port 0 takes any free one.
  explicit CameraServer(int port);
  ~CameraServer();
  CameraServer(const CameraServer&) = delete;
  CameraServer& operator=(const CameraServer&) = delete;

  int port() const;
  // Safe to call from any thread.
  void Show(Utime captured, std::vector<std::uint8_t> jpeg);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace beckon::simulation
