#include "services/beacon_reader/line_decoder.hpp"

namespace beckon {

std::vector<WireReading> LineDecoder::Push(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kMaxLine = 256;
  std::vector<WireReading> readings;
  for (const std::uint8_t byte : bytes) {
    if (byte == '\n') {
      TakeLine(readings);
    } else if (line_.size() < kMaxLine) {
      line_.push_back(static_cast<char>(byte));
    } else {
      too_long_ = true;
    }
  }
  return readings;
}

void LineDecoder::Restart() {
  line_.clear();
  too_long_ = false;
}

void LineDecoder::TakeLine(std::vector<WireReading>& readings) {
  const std::vector<std::string_view> words = Words(line_);
  WireReading reading;
  if (too_long_) {
    ++counts_.refused;
  } else if (words.empty() || words.front().starts_with('#')) {
    // Nothing to read.
  } else if (words.size() == 3 && IsId(words[0]) && IsId(words[1]) &&
             ParseRssi(words[2], reading.rssi_dbm)) {
    reading.beacon = words[0];
    reading.tag = words[1];
    readings.push_back(std::move(reading));
    ++counts_.accepted;
  } else {
    ++counts_.refused;
  }
  Restart();
}

}  // namespace beckon
