#include "services/beacon_reader/device_feed.hpp"

#include <algorithm>
#include <thread>
#include <utility>

namespace beckon {
namespace {

constexpr std::chrono::milliseconds kPatience{100};  // between looks at whether to stop

void Pause(const std::stop_token& stop, std::chrono::milliseconds pause) {
  for (; pause.count() > 0 && !stop.stop_requested(); pause -= kPatience) {
    std::this_thread::sleep_for(std::min(pause, kPatience));
  }
}

// Lets so many readings through in each second.
class RateLimit {
 public:
  explicit RateLimit(int per_second) : per_second_(per_second) {}
  bool Admit(const Instant& now) {
    if (now.steady - second_ >= std::chrono::seconds(1)) {
      second_ = now.steady;
      admitted_ = 0;
    }
    return ++admitted_ <= per_second_;
  }

 private:
  int per_second_;
  int admitted_ = 0;
  std::chrono::microseconds second_{};
};

}  // namespace

std::chrono::milliseconds BackOff::Next() {
  return std::exchange(pause_, std::min(2 * pause_, kLongest));
}

void FeedHealth::OnOpened(const Instant& now) {
  opened_ = last_accepted_ = last_bytes_ = now;
  heard_ = false;
}

void FeedHealth::OnBytes(const DecoderCounts& counts, const Instant& now) {
  last_bytes_ = now;
  if (counts.accepted == accepted_) return;
  accepted_ = counts.accepted;
  last_accepted_ = now;
  heard_ = true;
}

FeedHealth::Verdict FeedHealth::At(const Instant& now) const {
  const auto quiet_after = std::chrono::microseconds(UtimeFromSeconds(quiet_after_s_));
  if (now.steady - last_accepted_.steady < quiet_after) {
    if (heard_) return {Health::kOk, ""};
    return {Health::kWaiting, device_ + " is open, nothing heard yet"};
  }
  if (now.steady - last_bytes_.steady < quiet_after) {
    return {Health::kDegraded,
            "bytes come from " + device_ + ", but no readings: are baud rate and format right?"};
  }
  return {Health::kDegraded, "nothing heard from " + device_ + " lately"};
}

void RunDeviceFeed(const std::stop_token& stop, Service& service, const DeviceFeedOptions& options,
                   Decoder& decoder,
                   const std::function<void(const WireReading&, Utime)>& publish) {
  BackOff back_off;
  RateLimit rate_limit(options.max_readings_per_s);
  FeedHealth health(options.device, options.quiet_after_s);
  while (!stop.stop_requested()) {
    try {
      ByteStream stream(options.device, options.baud);
      decoder.Restart();
      health.OnOpened(service.clock().Now());
      while (!stop.stop_requested()) {
        const std::vector<std::uint8_t> bytes = stream.Read(kPatience);
        const Instant now = service.clock().Now();
        if (!bytes.empty()) {
          const std::int64_t refused_before = decoder.counts().refused;
          std::int64_t received = 0;
          std::int64_t dropped = 0;
          for (const WireReading& reading : decoder.Push(bytes)) {
            if (rate_limit.Admit(now)) {
              publish(reading, now.utime);
              ++received;
            } else {
              ++dropped;
            }
          }
          service.CountInput(received, decoder.counts().refused - refused_before, dropped);
          health.OnBytes(decoder.counts(), now);
          back_off.Reset();
          if (const auto request = decoder.TakeRequests(); !request.empty()) stream.Write(request);
        }
        const FeedHealth::Verdict verdict = health.At(now);
        service.SetHealth(verdict.state, verdict.reason);
      }
    } catch (const std::runtime_error& error) {
      service.SetHealth(Health::kFailed, error.what());
      Pause(stop, back_off.Next());
    }
  }
}

}  // namespace beckon
