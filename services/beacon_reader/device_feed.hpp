// Keeps a device open, and hands on what a decoder makes of its bytes.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "common/clock.hpp"
#include "common/service.hpp"
#include "services/beacon_reader/byte_stream.hpp"
#include "services/beacon_reader/decoder.hpp"

namespace beckon {

// Pause before the next attempt to open a device: a quarter of a second, then twice as long each
// time, up to two seconds, so that a device that comes back is back soon.
class BackOff {
 public:
  std::chrono::milliseconds Next();
  void Reset() { pause_ = kFirst; }

 private:
  static constexpr std::chrono::milliseconds kFirst{250};
  static constexpr std::chrono::milliseconds kLongest{2000};
  std::chrono::milliseconds pause_ = kFirst;
};

// What can be said of a device from what has come lately. Pure: time is passed in.
class FeedHealth {
 public:
  FeedHealth(std::string device, double quiet_after_s)
      : device_(std::move(device)), quiet_after_s_(quiet_after_s) {}

  void OnOpened(const Instant& now);
  void OnBytes(const DecoderCounts& counts, const Instant& now);

  struct Verdict {
    Health state;
    std::string reason;
  };
  Verdict At(const Instant& now) const;

 private:
  std::string device_;
  double quiet_after_s_;
  Instant opened_;
  Instant last_accepted_;
  Instant last_bytes_;
  std::int64_t accepted_ = 0;
  bool heard_ = false;  // since it was opened
};

struct DeviceFeedOptions {
  std::string device;
  int baud = 9600;
  double quiet_after_s = 5.0;
  int max_readings_per_s = 20000;
};

// Runs until `stop` is requested, for a thread of its own. Readings are dated to when their last
// byte was read. A device that cannot be opened or goes away is tried again, and HEALTH says so.
void RunDeviceFeed(const std::stop_token& stop, Service& service, const DeviceFeedOptions& options,
                   Decoder& decoder, const std::function<void(const WireReading&, Utime)>& publish);

}  // namespace beckon
