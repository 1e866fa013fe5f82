// A steady pace on the steady clock.
#pragma once

#include <algorithm>
#include <chrono>
#include <thread>

#include "common/clock.hpp"

namespace beckon {

class Pacer {
 public:
  Pacer(double rate_hz, double start_delay_s, const Clock& clock)
      : clock_(clock),
        period_(static_cast<std::int64_t>(1e6 / rate_hz)),
        due_(clock.Now().steady + std::chrono::microseconds(UtimeFromSeconds(start_delay_s))) {}

  // Waits until the next turn, but no longer than `timeout`. True when it is time; the turn after
  // this is then one period after this one was due, or after now for one who comes late.
  bool Wait(std::chrono::milliseconds timeout) {
    const auto wait = due_ - clock_.Now().steady;
    if (wait > std::chrono::microseconds::zero() && timeout > std::chrono::milliseconds::zero()) {
      std::this_thread::sleep_for(std::min<std::chrono::microseconds>(wait, timeout));
    }
    const auto now = clock_.Now().steady;
    if (now < due_) return false;
    due_ = std::max(due_, now - period_) + period_;
    return true;
  }

 private:
  const Clock& clock_;
  const std::chrono::microseconds period_;
  std::chrono::microseconds due_;
};

}  // namespace beckon
