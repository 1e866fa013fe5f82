#include "tools/base_adapter/device_link.hpp"

#include <stdexcept>

namespace beckon {

void DeviceLink::With(Instant now, const std::function<void(ByteStream&)>& use) {
  if (!stream_ && now.steady < try_at_.steady) return;
  try {
    if (!stream_) {
      stream_ = std::make_unique<ByteStream>(device_, baud_);
      on_opened();
    }
    use(*stream_);
    back_off_.Reset();
  } catch (const std::runtime_error& error) {
    stream_.reset();
    try_at_ = now;
    try_at_.steady += back_off_.Next();
    on_lost(error.what());
  }
}

}  // namespace beckon
