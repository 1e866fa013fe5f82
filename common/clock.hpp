// Time, so that every algorithm can be given it instead of asking for it.
#pragma once

#include <chrono>
#include <cstdint>

namespace beckon {

// Microseconds since the Unix epoch, as in every message.
using Utime = std::int64_t;

constexpr Utime UtimeFromSeconds(double seconds) {
  return static_cast<Utime>(seconds * 1e6 + (seconds < 0 ? -0.5 : 0.5));
}
constexpr double SecondsFromUtime(Utime utime) { return static_cast<double>(utime) * 1e-6; }

// One moment on both clocks. The wall clock dates measurements and can be compared between hosts,
// but may be stepped at any time. The steady clock never jumps: ages and timeouts are measured on
// it.
struct Instant {
  Utime utime = 0;                     // wall clock
  std::chrono::microseconds steady{};  // since an arbitrary start
};

// On the steady clock.
inline double SecondsSince(Instant now, Instant then) {
  return std::chrono::duration<double>(now.steady - then.steady).count();
}

class Clock {
 public:
  virtual ~Clock() = default;
  virtual Instant Now() const = 0;
};

class SystemClock : public Clock {
 public:
  Instant Now() const override;
};

// A clock that stands still until it is told otherwise, for tests and for running faster than real
// time.
class ManualClock : public Clock {
 public:
  explicit ManualClock(Utime start_utime = 1'700'000'000'000'000) { now_.utime = start_utime; }
  Instant Now() const override { return now_; }
  void Advance(std::chrono::microseconds by) {
    now_.utime += by.count();
    now_.steady += by;
  }
  // What an administrator or NTP does: the wall clock jumps, the steady clock does not.
  void StepWallClock(std::chrono::microseconds by) { now_.utime += by.count(); }

 private:
  Instant now_;
};

}  // namespace beckon
