// Configuration of beacon_reader: table [beacon_reader], and [site] folder for playback.
#pragma once

#include <string>
#include <vector>

#include "common/config.hpp"
#include "common/site.hpp"
#include "services/beacon_reader/playback.hpp"
#include "services/beacon_reader/xbee_decoder.hpp"

namespace beckon {

struct BeaconReaderOptions {
  enum class Source { kXbee, kLines, kPlayback };
  Source source = Source::kXbee;
  std::string device;              // of kXbee and kLines, see ByteStream
  int baud = 9600;                 // what an XBee is delivered with
  double quiet_after_s = 5.0;      // nothing heard for so long is worth a word in HEALTH
  int max_readings_per_s = 20000;  // more are dropped and counted
  XbeeOptions xbee;
  PlaybackOptions playback;
  std::vector<Reading> recorded;  // of kPlayback
};

// Throws ConfigError or FileError, naming file and line.
BeaconReaderOptions ReadBeaconReaderOptions(ConfigFile& file);

}  // namespace beckon
