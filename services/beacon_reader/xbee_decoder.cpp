#include "services/beacon_reader/xbee_decoder.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "common/site.hpp"

namespace beckon {
namespace {

constexpr std::uint8_t kAtCommand = 0x08;
constexpr std::uint8_t kReceive64 = 0x80;
constexpr std::uint8_t kReceive16 = 0x81;
constexpr std::uint8_t kAtResponse = 0x88;
constexpr std::uint8_t kReceiveMesh = 0x90;

}  // namespace

XbeeDecoder::XbeeDecoder(XbeeOptions options)
    : options_(std::move(options)), deframer_(options_.api_mode) {}

std::vector<WireReading> XbeeDecoder::Push(std::span<const std::uint8_t> bytes) {
  std::vector<WireReading> readings;
  deframer_.Push(bytes);
  while (const auto data = deframer_.Next()) TakeFrame(*data, readings);
  counts_.refused = frames_refused_ + deframer_.broken();
  counts_.garbage = deframer_.garbage();
  return readings;
}

std::vector<std::uint8_t> XbeeDecoder::TakeRequests() { return std::exchange(requests_, {}); }

void XbeeDecoder::Restart() {
  deframer_.Restart();
  requests_.clear();
  awaiting_power_of_.clear();
}

void XbeeDecoder::TakeFrame(Data data, std::vector<WireReading>& readings) {
  switch (data.front()) {
    case kReceive16:
      if (data.size() < 5) break;
      return TakeReceived(data.subspan(1, 2), data[3], data.subspan(5), readings);
    case kReceive64:
      if (data.size() < 11) break;
      return TakeReceived(data.subspan(1, 8), data[9], data.subspan(11), readings);
    case kReceiveMesh:
      if (data.size() < 12) break;
      return TakeMesh(data, readings);
    case kAtResponse:
      if (data.size() < 5) break;
      return TakeAtResponse(data, readings);
    default:  // modem status and the like: well-formed, and nothing for us
      ++counts_.accepted;
      return;
  }
  ++frames_refused_;
}

void XbeeDecoder::TakeReceived(Data address, std::uint8_t rssi, Data payload,
                               std::vector<WireReading>& readings) {
  awaiting_power_of_.clear();
  const std::string beacon = BeaconOf(address);
  AddRobot(beacon, rssi, readings);
  AddReports(beacon, payload, readings);
}

void XbeeDecoder::TakeMesh(Data data, std::vector<WireReading>& readings) {
  awaiting_power_of_ = BeaconOf(data.subspan(1, 8));
  ++counts_.accepted;
  AddReports(awaiting_power_of_, data.subspan(12), readings);
  frame_id_ = frame_id_ == 0xff ? 1 : static_cast<std::uint8_t>(frame_id_ + 1);
  // Only the newest packet's power can be asked for.
  const std::array<std::uint8_t, 4> command = {kAtCommand, frame_id_, 'D', 'B'};
  requests_ = XbeeFrame(command, options_.api_mode);
}

void XbeeDecoder::TakeAtResponse(Data data, std::vector<WireReading>& readings) {
  const bool is_power = data[2] == 'D' && data[3] == 'B';
  if (!is_power || data[1] != frame_id_ || awaiting_power_of_.empty()) {
    ++counts_.accepted;
    return;
  }
  const std::string beacon = std::exchange(awaiting_power_of_, {});
  if (data[4] != 0 || data.size() < 6) {
    ++frames_refused_;
    return;
  }
  AddRobot(beacon, data[5], readings);
}

void XbeeDecoder::AddRobot(const std::string& beacon, std::uint8_t rssi,
                           std::vector<WireReading>& readings) {
  const double rssi_dbm = -static_cast<double>(rssi);
  // The radio says 0 where it has not measured, and 255 where it failed to.
  if (rssi == 0 || !IsPlausibleRssi(rssi_dbm)) {
    ++frames_refused_;
    return;
  }
  ++counts_.accepted;
  readings.push_back({options_.robot_tag, beacon, rssi_dbm});
}

void XbeeDecoder::AddReports(const std::string& beacon, Data payload,
                             std::vector<WireReading>& readings) {
  const std::string_view text(reinterpret_cast<const char*>(payload.data()), payload.size());
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::vector<std::string_view> words = Words(text.substr(begin, end - begin));
    WireReading reading{"", beacon, 0.0};
    // A payload that is not ours is no error: beacons may have other things to say.
    if (words.size() == 2 && IsId(words[0]) && ParseRssi(words[1], reading.rssi_dbm)) {
      reading.tag = words[0];
      readings.push_back(std::move(reading));
    }
    begin = end + 1;
  }
}

std::string XbeeDecoder::BeaconOf(Data address) const {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string hex;
  for (const std::uint8_t byte : address) {
    hex.push_back(kDigits[byte >> 4]);
    hex.push_back(kDigits[byte & 0xfU]);
  }
  const auto known = options_.beacon_of_address.find(hex);
  return known != options_.beacon_of_address.end() ? known->second : hex;
}

}  // namespace beckon
