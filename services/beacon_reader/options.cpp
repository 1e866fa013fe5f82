#include "services/beacon_reader/options.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "services/beacon_reader/byte_stream.hpp"

namespace beckon {
namespace {

void ReadBeacons(ConfigTable& table, std::map<std::string, std::string>& beacon_of_address) {
  for (ConfigTable* beacon : table.Tables("beacons")) {
    std::string address;
    std::string id;
    beacon->Required("address", address);
    beacon->Required("id", id);
    const bool is_hex = std::all_of(address.begin(), address.end(),
                                    [](unsigned char c) { return std::isxdigit(c) != 0; });
    if (!is_hex || (address.size() != 4 && address.size() != 16)) {
      beacon->Fail("address", "has to be 4 or 16 hexadecimal digits, it is '" + address + "'");
    }
    std::transform(address.begin(), address.end(), address.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    if (!IsId(id)) beacon->Fail("id", "has to be 1 to 64 printable characters without blanks");
    if (!beacon_of_address.emplace(address, id).second) {
      beacon->Fail("address", "'" + address + "' is given twice");
    }
  }
}

void ReadDevice(ConfigTable& table, BeaconReaderOptions& options) {
  table.Required("device", options.device);
  if (options.device.starts_with("tcp:")) {
    std::string host;
    std::string port;
    if (!SplitTcp(options.device, host, port)) {
      table.Fail("device", "a TCP device is written tcp:HOST:PORT");
    }
  } else {
    std::filesystem::path path;
    table.RequiredPath("device", path);
    options.device = path.string();
  }
  table.Optional("baud", options.baud);
  if (!IsBaudRate(options.baud)) {
    table.Fail("baud", std::to_string(options.baud) + " is not a baud rate of serial ports");
  }
  table.Optional("quiet_after_s", options.quiet_after_s, Range{0.5, 3600.0});
  table.Optional("max_readings_per_s", options.max_readings_per_s, Range{1, 1e6});
}

void ReadPlayback(ConfigFile& file, ConfigTable& table, BeaconReaderOptions& options) {
  PlaybackOptions& playback = options.playback;
  table.Optional("speed", playback.speed, Range{0.01, 1000.0});
  table.Optional("loop", playback.loop);
  table.Optional("restamp", playback.restamp);
  if (playback.loop && !playback.restamp) {
    table.Fail("restamp", "a loop with recorded dates would run backwards in time");
  }
  std::filesystem::path folder;
  file.Table("site").RequiredPath("folder", folder);
  options.recorded = LoadReadings(folder / "readings.csv", Site::Load(folder));
  if (options.recorded.empty()) table.Fail("source", "there are no readings in " + folder.string());
}

}  // namespace

BeaconReaderOptions ReadBeaconReaderOptions(ConfigFile& file) {
  BeaconReaderOptions options;
  ConfigTable& table = file.Table("beacon_reader");
  std::string source = "xbee";
  table.OptionalChoice("source", source, {"xbee", "lines", "playback"});
  if (source == "playback") {
    options.source = BeaconReaderOptions::Source::kPlayback;
    ReadPlayback(file, table, options);
    return options;
  }
  ReadDevice(table, options);
  if (source == "lines") {
    options.source = BeaconReaderOptions::Source::kLines;
    return options;
  }
  int api_mode = 2;
  table.Optional("api_mode", api_mode, Range{1, 2});
  options.xbee.api_mode = api_mode == 1 ? XbeeApiMode::kPlain : XbeeApiMode::kEscaped;
  table.Optional("robot_tag", options.xbee.robot_tag);
  if (!IsId(options.xbee.robot_tag)) {
    table.Fail("robot_tag", "has to be 1 to 64 printable characters without blanks");
  }
  ReadBeacons(table, options.xbee.beacon_of_address);
  return options;
}

}  // namespace beckon
