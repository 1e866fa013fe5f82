// Readings from an XBee coordinator that rides on the robot.
//
// The convention: every frame that a beacon sends is itself a reading, of the robot's own tag, with
// the power at which the coordinator received it. If the payload is text, each of its lines `tag
// rssi_dbm` is the beacon's report of a tag that it heard. Frames understood:
//   0x81  receive, 16-bit address: address (2), RSSI (1, in -dBm), options (1), payload
//   0x80  receive, 64-bit address: address (8), RSSI (1, in -dBm), options (1), payload
//   0x90  receive of mesh firmware: address (8), 16-bit address (2), options (1), payload; it
//   carries no
//         RSSI, so the AT command DB (power of the last packet) is sent after it and answered by
//   0x88  AT response: frame id (1), "DB", status (1), value (1, in -dBm)
// A DB answer is used only when no other packet came in between: it would be the other's power.
// Mesh packets may have come over several hops, and DB tells the last one: let beacons report in
// one hop (NH=1).
#pragma once

#include <map>
#include <string>

#include "services/beacon_reader/decoder.hpp"
#include "services/beacon_reader/xbee_frames.hpp"

namespace beckon {

struct XbeeOptions {
  XbeeApiMode api_mode = XbeeApiMode::kEscaped;
  std::string robot_tag = "robot";
  // Id of a beacon by its address as 4 or 16 upper-case hex digits; others go by the digits
  // themselves.
  std::map<std::string, std::string> beacon_of_address;
};

class XbeeDecoder : public Decoder {
 public:
  explicit XbeeDecoder(XbeeOptions options);

  std::vector<WireReading> Push(std::span<const std::uint8_t> bytes) override;
  std::vector<std::uint8_t> TakeRequests() override;
  void Restart() override;

 private:
  using Data = std::span<const std::uint8_t>;
  void TakeFrame(Data data, std::vector<WireReading>& readings);
  void TakeReceived(Data address, std::uint8_t rssi, Data payload,
                    std::vector<WireReading>& readings);
  void TakeMesh(Data data, std::vector<WireReading>& readings);
  void TakeAtResponse(Data data, std::vector<WireReading>& readings);
  void AddRobot(const std::string& beacon, std::uint8_t rssi, std::vector<WireReading>& readings);
  void AddReports(const std::string& beacon, Data payload, std::vector<WireReading>& readings);
  std::string BeaconOf(Data address) const;

  XbeeOptions options_;
  XbeeDeframer deframer_;
  std::int64_t frames_refused_ = 0;
  std::vector<std::uint8_t> requests_;
  std::uint8_t frame_id_ = 0;      // of the last DB command
  std::string awaiting_power_of_;  // beacon whose packet it asks about; empty: none
};

}  // namespace beckon
