// The smallest service: answers every RSSI with a CALL of the same utime. A reading of tag "hang"
// hangs it, one of tag "throw" makes its handler throw.
#include <thread>

#include "beckon/call_t.hpp"
#include "beckon/rssi_reading_t.hpp"
#include "common/channels.hpp"
#include "common/service.hpp"

namespace {

struct Options {
  double gain = 1.0;
};

Options ReadOptions(beckon::ConfigFile& file) {
  Options options;
  file.Table("navigator").Optional("gain", options.gain, beckon::Range{0.0, 10.0});
  return options;
}

void Run(beckon::Service& service, const Options&) {
  service.bus().Subscribe<beckon::rssi_reading_t>(
      beckon::channels::kRssi, [&](const beckon::rssi_reading_t& reading) {
        if (reading.tag == "hang") std::this_thread::sleep_for(std::chrono::hours(1));
        if (reading.tag == "throw") throw std::runtime_error("as asked for");
        beckon::call_t call{};
        call.utime = reading.utime;
        service.bus().Publish(beckon::channels::kCall, call);
        service.SetHealth(beckon::Health::kOk);
      });
  service.OnStop([&] {
    beckon::call_t last{};
    last.utime = -1;
    service.bus().Publish(beckon::channels::kCall, last);
  });
  service.Run();
}

}  // namespace

int main(int argc, char** argv) {
  return beckon::RunService(argc, argv, {"echo_service", "Answers RSSI with CALL."}, ReadOptions,
                            Run);
}
