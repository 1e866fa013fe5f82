#include "common/clock.hpp"

namespace beckon {

Instant SystemClock::Now() const {
  using std::chrono::duration_cast;
  using std::chrono::microseconds;
  const auto wall = std::chrono::system_clock::now().time_since_epoch();
  const auto steady = std::chrono::steady_clock::now().time_since_epoch();
  return {duration_cast<microseconds>(wall).count(), duration_cast<microseconds>(steady)};
}

}  // namespace beckon
