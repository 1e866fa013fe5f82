#include "services/beacon_reader/xbee_frames.hpp"

#include <algorithm>

namespace beckon {
namespace {

constexpr std::uint8_t kDelimiter = 0x7e;
constexpr std::uint8_t kEscape = 0x7d;
constexpr std::uint8_t kEscapeXor = 0x20;
// More than any receive frame (255 bytes of payload and its header). A length beyond it is no
// length, and waiting for so many bytes would deafen the reader.
constexpr std::size_t kMaxData = 300;

bool NeedsEscape(std::uint8_t byte) {
  return byte == kDelimiter || byte == kEscape || byte == 0x11 || byte == 0x13;
}

}  // namespace

void XbeeDeframer::Push(std::span<const std::uint8_t> bytes) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

XbeeDeframer::Scan XbeeDeframer::ScanFront(std::vector<std::uint8_t>& data,
                                           std::size_t& used) const {
  std::size_t position = 1;
  bool unfinished = false;
  bool broken = false;
  const auto next = [&]() -> std::uint8_t {
    if (position >= buffer_.size()) {
      unfinished = true;
      return 0;
    }
    std::uint8_t byte = buffer_[position];
    if (mode_ == XbeeApiMode::kPlain) {
      ++position;
      return byte;
    }
    // In escape mode a bare 0x7E is always the start of another frame: this one was cut off.
    if (byte == kDelimiter) {
      broken = true;
      return 0;
    }
    ++position;
    if (byte == kEscape) {
      if (position >= buffer_.size()) {
        unfinished = true;
        return 0;
      }
      if (buffer_[position] == kDelimiter) {
        broken = true;
        return 0;
      }
      byte = buffer_[position++] ^ kEscapeXor;
    }
    return byte;
  };

  const std::size_t high = next();
  const std::size_t length = high << 8 | next();
  if (broken) return Scan::kBroken;
  if (unfinished) return Scan::kNeedMore;
  if (length == 0 || length > kMaxData) return Scan::kNotAFrame;
  data.clear();
  std::uint8_t sum = 0;
  for (std::size_t i = 0; i < length + 1; ++i) {
    const std::uint8_t byte = next();
    if (broken) return Scan::kBroken;
    if (unfinished) return Scan::kNeedMore;
    sum = static_cast<std::uint8_t>(sum + byte);
    if (i < length) data.push_back(byte);
  }
  used = position;
  return sum == 0xff ? Scan::kWhole : Scan::kBroken;
}

std::optional<std::vector<std::uint8_t>> XbeeDeframer::Next() {
  std::vector<std::uint8_t> data;
  std::size_t begin = 0;
  std::optional<std::vector<std::uint8_t>> frame;
  while (!frame) {
    const auto start = std::find(buffer_.begin(), buffer_.end(), kDelimiter);
    garbage_ += start - buffer_.begin();
    buffer_.erase(buffer_.begin(), start);
    if (buffer_.empty()) break;
    std::size_t used = 0;
    const Scan scan = ScanFront(data, used);
    if (scan == Scan::kNeedMore) break;
    if (scan == Scan::kWhole) {
      begin = used;
      frame = std::move(data);
    } else {
      if (scan == Scan::kBroken) ++broken_;
      if (scan == Scan::kNotAFrame) ++garbage_;
      begin = 1;
    }
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin));
  }
  return frame;
}

std::vector<std::uint8_t> XbeeFrame(std::span<const std::uint8_t> data, XbeeApiMode mode) {
  std::vector<std::uint8_t> frame = {kDelimiter};
  const auto append = [&](std::uint8_t byte) {
    if (mode == XbeeApiMode::kEscaped && NeedsEscape(byte)) {
      frame.push_back(kEscape);
      byte ^= kEscapeXor;
    }
    frame.push_back(byte);
  };
  append(static_cast<std::uint8_t>(data.size() >> 8));
  append(static_cast<std::uint8_t>(data.size() & 0xffU));
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : data) {
    sum = static_cast<std::uint8_t>(sum + byte);
    append(byte);
  }
  append(static_cast<std::uint8_t>(0xff - sum));
  return frame;
}

}  // namespace beckon
