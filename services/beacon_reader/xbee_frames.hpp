// Frames of an XBee radio in API mode: 0x7E, length (2 bytes, big endian), data, checksum.
//
// Digi: XBee/XBee-PRO S2C 802.15.4 RF Module User Guide (90001500), "API operation".
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace beckon {

enum class XbeeApiMode {
  kPlain = 1,    // AP=1
  kEscaped = 2,  // AP=2: 0x7E, 0x7D, 0x11 and 0x13 inside a frame are sent as 0x7D, byte ^ 0x20
};

// Finds frames in a stream of bytes that may start, stop and break anywhere.
class XbeeDeframer {
 public:
  explicit XbeeDeframer(XbeeApiMode mode) : mode_(mode) {}

  void Push(std::span<const std::uint8_t> bytes);
  // Data of the next whole frame with a right checksum, type byte first; nothing where more bytes
  // are needed. After a broken frame the search goes on at the byte after its start, so that a 0x7E
  // inside what was taken for a frame is not lost.
  std::optional<std::vector<std::uint8_t>> Next();
  void Restart() { buffer_.clear(); }

  std::int64_t broken() const { return broken_; }    // frames with a wrong checksum or escape
  std::int64_t garbage() const { return garbage_; }  // bytes outside of frames

 private:
  enum class Scan { kWhole, kNeedMore, kBroken, kNotAFrame };
  // Looks at the frame that starts at the front of the buffer; `used`: bytes it takes there.
  Scan ScanFront(std::vector<std::uint8_t>& data, std::size_t& used) const;

  XbeeApiMode mode_;
  std::vector<std::uint8_t> buffer_;
  std::int64_t broken_ = 0;
  std::int64_t garbage_ = 0;
};

// The frame around data, as it goes over the wire.
std::vector<std::uint8_t> XbeeFrame(std::span<const std::uint8_t> data, XbeeApiMode mode);

}  // namespace beckon
