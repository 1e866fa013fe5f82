// What every service has in common: command line, configuration, logging, message loop, timers,
// HEALTH, watchdog, and a clean end on SIGTERM.
//
//   void Run(Service& service, const Options& options) {
//     RangeCaster caster(options);
//     service.bus().SubscribeLatest<ground_t>(
//         channels::kGround, [&](const ground_t& ground) { ... });
//     service.Run();
//   }
//   int main(int argc, char** argv) { return RunService(argc, argv, kAbout, ReadOptions, Run); }
//
// Exit codes: 0 after SIGTERM or SIGINT, 2 for a bad command line or configuration, 70
// (EX_SOFTWARE) when the watchdog found the message loop hung.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/clock.hpp"
#include "common/config.hpp"
#include "common/message_bus.hpp"

namespace beckon {

struct ServiceAbout {
  std::string name;         // also the name of its table in the configuration
  std::string description;  // for --help: what it does, channels in, channels out
};

enum class Health { kOk, kWaiting, kDegraded, kFailed };

class Service {
 public:
  virtual ~Service() = default;

  virtual MessageBus& bus() = 0;
  virtual const Clock& clock() const = 0;

  // Calls `task` from the message loop, first at once and then every `period`. A turn that comes
  // too late is passed over, not made up for.
  virtual void Every(std::chrono::milliseconds period, std::function<void(Instant)> task) = 0;

  // State for HEALTH until the next call. Safe to call from any thread. Changes are logged.
  virtual void SetHealth(Health state, const std::string& reason) = 0;
  void SetHealth(Health state) { SetHealth(state, ""); }
  // Adds to the counters of HEALTH: input that came by another way than LCM (radio, camera).
  virtual void CountInput(std::int64_t received, std::int64_t refused, std::int64_t dropped) = 0;

  // Called when the service is told to end, while the bus still works.
  virtual void OnStop(std::function<void()> task) = 0;
  // Whether the service has been told to end: for threads of its own. Safe to call from any thread.
  virtual bool stopping() const = 0;

  // Handles messages and timers until SIGTERM or SIGINT.
  virtual void Run() = 0;
};

namespace internal {
int RunServiceImpl(int argc, char** argv, const ServiceAbout& about,
                   const std::function<void(ConfigFile&)>& read,
                   const std::function<void(Service&)>& run);
}  // namespace internal

// `read` takes what the service needs from the configuration; `run` wires it and calls
// service.Run().
template <typename Options>
int RunService(int argc, char** argv, const ServiceAbout& about, Options (*read)(ConfigFile&),
               void (*run)(Service&, const Options&)) {
  Options options{};
  return internal::RunServiceImpl(
      argc, argv, about, [&](ConfigFile& file) { options = read(file); },
      [&](Service& service) { run(service, options); });
}

}  // namespace beckon
