// From bytes of a device to readings: the interface of the wire formats. Pure: no clock, no device.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace beckon {

// One reading as it comes over the wire; the time is the reader's affair.
struct WireReading {
  std::string tag;
  std::string beacon;
  double rssi_dbm = 0.0;

  bool operator==(const WireReading&) const = default;
};

struct DecoderCounts {
  std::int64_t accepted = 0;  // frames or lines that were understood
  std::int64_t refused = 0;   // frames or lines that were not: wrong checksum, nonsense in them
  std::int64_t garbage = 0;   // bytes passed over in search of the start of a frame
};

class Decoder {
 public:
  virtual ~Decoder() = default;

  // Takes the next bytes, however they are cut into pieces, and returns the readings they complete.
  virtual std::vector<WireReading> Push(std::span<const std::uint8_t> bytes) = 0;
  // Bytes to be written to the device in answer to what came; empty for most formats.
  virtual std::vector<std::uint8_t> TakeRequests() { return {}; }
  // Forgets a frame or line begun: the device was opened anew.
  virtual void Restart() = 0;

  const DecoderCounts& counts() const { return counts_; }

 protected:
  DecoderCounts counts_;
};

// Splits "a b c" at blanks and tabs; a carriage return at the end is not part of it.
std::vector<std::string_view> Words(std::string_view line);
// The whole word as a received power that a radio can report; false for anything else, NaN
// included.
bool ParseRssi(std::string_view word, double& rssi_dbm);
// Whether a word can be the id of a tag or beacon: 1 to 64 printable ASCII characters.
bool IsId(std::string_view word);

}  // namespace beckon
