// Keeps a device open, and tries again with growing pauses where it cannot or has gone.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "services/beacon_reader/device_feed.hpp"

namespace beckon {

class DeviceLink {
 public:
  DeviceLink(const std::string& device, int baud) : device_(device), baud_(baud) {}

  std::function<void()> on_opened = [] {};
  std::function<void(const std::string& why)> on_lost = [](const std::string&) {};

  // Calls `use` with the device, unless it is gone at present.
  void With(Instant now, const std::function<void(ByteStream&)>& use);

 private:
  std::string device_;
  int baud_;
  std::unique_ptr<ByteStream> stream_;
  BackOff back_off_;
  Instant try_at_{};
};

}  // namespace beckon
