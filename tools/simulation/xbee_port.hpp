// An XBee coordinator on a pseudo-terminal, as beacon_reader finds it on a serial port.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/simulation/radio.hpp"

namespace beckon::simulation {

// A received packet as an XBee tells it in API mode 2 (escaped): frame 0x81 with 16-bit source
// address (the beacon's id, four hexadecimal digits), RSSI byte (-dBm), options, and as payload one
// line "tag rssi_dbm" for each tag that the beacon heard. Digi, "XBee/XBee-PRO RF Modules",
// 90000982, chapter API operation.
std::vector<std::uint8_t> XbeeBytes(const RadioPacket& packet);

class XbeePort {
 public:
  // Opens a pseudo-terminal and makes `link` point to it; a link that is there already is replaced,
  // any other file is not. Throws std::runtime_error.
  explicit XbeePort(const std::filesystem::path& link);
  // Removes the link, if it is still its own.
  ~XbeePort();
  XbeePort(const XbeePort&) = delete;
  XbeePort& operator=(const XbeePort&) = delete;

  // Never blocks: what nobody reads is lost, as on a wire. Drops what has been written to the port.
  void Write(const std::vector<std::uint8_t>& bytes);

 private:
  std::filesystem::path link_;
  std::filesystem::path terminal_name_;
  int controller_ = -1;
  int terminal_ = -1;  // kept open, so that readers may come and go
};

}  // namespace beckon::simulation
