// The line protocol: one reading a line, `beacon tag rssi_dbm`, for anything that is not an XBee.
#pragma once

#include <string>

#include "services/beacon_reader/decoder.hpp"

namespace beckon {

// Words are separated by blanks or tabs, lines end with \n or \r\n. Empty lines and lines that
// begin with # are passed over. A line of more than 256 bytes is refused as a whole, so that a
// device that never sends a line end costs no memory.
class LineDecoder : public Decoder {
 public:
  std::vector<WireReading> Push(std::span<const std::uint8_t> bytes) override;
  // The rest of the line that is under way belongs to a line whose beginning was not seen.
  void Restart() override;

 private:
  void TakeLine(std::vector<WireReading>& readings);

  std::string line_;
  bool too_long_ = false;
};

}  // namespace beckon
