// beacon_reader: from radio hardware, a line protocol or a recording to RSSI.
#include <thread>

#include "beckon/rssi_reading_t.hpp"
#include "common/channels.hpp"
#include "common/service.hpp"
#include "services/beacon_reader/device_feed.hpp"
#include "services/beacon_reader/line_decoder.hpp"
#include "services/beacon_reader/options.hpp"

namespace beckon {
namespace {

void Publish(Service& service, Utime utime, const std::string& tag, const std::string& beacon,
             double rssi_dbm) {
  rssi_reading_t message{};
  message.utime = utime;
  message.tag = tag;
  message.beacon = beacon;
  message.rssi_dbm = static_cast<float>(rssi_dbm);
  service.bus().Publish(channels::kRssi, message);
}

void RunPlayback(Service& service, const BeaconReaderOptions& options) {
  Playback playback(options.recorded, options.playback);
  service.Every(std::chrono::milliseconds(10), [&](Instant now) {
    const std::vector<Reading> due = playback.Due(now);
    for (const Reading& r : due) Publish(service, r.utime, r.tag, r.beacon, r.rssi_dbm);
    service.CountInput(static_cast<std::int64_t>(due.size()), 0, 0);
    service.SetHealth(playback.ended() ? Health::kWaiting : Health::kOk,
                      playback.ended() ? "the recording has ended" : "");
  });
  service.Run();
}

void Run(Service& service, const BeaconReaderOptions& options) {
  if (options.source == BeaconReaderOptions::Source::kPlayback) {
    RunPlayback(service, options);
    return;
  }
  std::unique_ptr<Decoder> decoder = std::make_unique<LineDecoder>();
  if (options.source == BeaconReaderOptions::Source::kXbee) {
    decoder = std::make_unique<XbeeDecoder>(options.xbee);
  }
  const DeviceFeedOptions feed = {options.device, options.baud, options.quiet_after_s,
                                  options.max_readings_per_s};
  const std::jthread reader([&](const std::stop_token& stop) {
    RunDeviceFeed(stop, service, feed, *decoder, [&](const WireReading& reading, Utime utime) {
      Publish(service, utime, reading.tag, reading.beacon, reading.rssi_dbm);
    });
  });
  service.Run();
}

}  // namespace
}  // namespace beckon

int main(int argc, char** argv) {
  return beckon::RunService(argc, argv,
                            {"beacon_reader",
                             "Reads beacons: XBee in API mode, a line protocol, or a recording.\n"
                             "In: a device. Out: RSSI, HEALTH."},
                            beckon::ReadBeaconReaderOptions, beckon::Run);
}
