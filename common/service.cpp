#include "common/service.hpp"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <iostream>
#include <mutex>
#include <thread>

#include "beckon/service_health_t.hpp"
#include "common/channels.hpp"
#include "common/log.hpp"
#include "common/robot_file.hpp"

namespace beckon {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kExitBadConfig = 2;
constexpr int kExitHung = 70;  // EX_SOFTWARE
constexpr milliseconds kLongestWait{50};
constexpr milliseconds kWatchdogTick{250};
constexpr std::size_t kBusySeconds = 10;
// Enough for the percentile of a second; a loop that turns faster than this is not a loop that is
// late.
constexpr std::size_t kMaxBusySamples = 2000;

std::atomic<bool> stop_requested = false;
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void RequestStop(int) { stop_requested = true; }

void InstallSignalHandlers() {
  struct sigaction action {};
  action.sa_handler = RequestStop;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // a device that goes away is an error code, not the end
}

struct RuntimeOptions {
  std::string lcm_url;
  double watchdog_s = 5.0;
  int memory_limit_mb = 3072;
};

RuntimeOptions ReadRuntimeOptions(ConfigFile& file) {
  RuntimeOptions options;
  options.lcm_url = ReadLcmUrl(file);
  ConfigTable& runtime = file.Table("runtime");
  runtime.Optional("watchdog_s", options.watchdog_s, Range{1.0, 3600.0});
  runtime.Optional("memory_limit_mb", options.memory_limit_mb, Range{256, 1 << 20});
  return options;
}

// A message that asks for gigabytes then gets std::bad_alloc, which the message bus catches.
void CapAddressSpace(int limit_mb) {
#ifndef BECKON_SANITIZED    // sanitizers map terabytes
  mallopt(M_ARENA_MAX, 2);  // each further arena would reserve 64 MiB
  const rlim_t bytes = static_cast<rlim_t>(limit_mb) << 20;
  const rlimit limit{bytes, bytes};
  if (setrlimit(RLIMIT_AS, &limit) != 0) LogWarning("the address space could not be capped");
#else
  static_cast<void>(limit_mb);
#endif
}

// Time that each turn of the loop was busy, over the last ten seconds.
class BusyTimes {
 public:
  void Add(float busy_ms) {
    auto& now = buckets_[current_];
    if (now.size() < kMaxBusySamples) now.push_back(busy_ms);
  }
  void NextSecond() {
    current_ = (current_ + 1) % buckets_.size();
    buckets_[current_].clear();
  }
  float Percentile99() const {
    std::vector<float> all;
    for (const auto& bucket : buckets_) all.insert(all.end(), bucket.begin(), bucket.end());
    if (all.empty()) return 0.0F;
    const auto rank = static_cast<std::ptrdiff_t>((all.size() - 1) * 99 / 100);
    std::nth_element(all.begin(), all.begin() + rank, all.end());
    return all[static_cast<std::size_t>(rank)];
  }

 private:
  std::array<std::vector<float>, kBusySeconds> buckets_;
  std::size_t current_ = 0;
};

// Ends the process when the loop stops turning, so that the supervisor starts a new one.
class Watchdog {
 public:
  explicit Watchdog(double limit_s) {
    thread_ = std::jthread([this, limit_s](const std::stop_token& token) {
      // Ticks are counted, not time: a process that was suspended has not been hanging.
      const int limit = std::max(
          1, static_cast<int>(limit_s / std::chrono::duration<double>(kWatchdogTick).count()));
      std::uint64_t last = 0;
      int ticks = 0;
      while (!token.stop_requested()) {
        std::this_thread::sleep_for(kWatchdogTick);
        const std::uint64_t beat = beat_;
        ticks = beat == last ? ticks + 1 : 0;
        last = beat;
        if (ticks >= limit) {
          LogError("the main loop has not turned for " + std::to_string(limit_s) +
                   " s: ending the process");
          _exit(kExitHung);
        }
      }
    });
  }
  void Beat() { ++beat_; }

 private:
  std::atomic<std::uint64_t> beat_ = 0;
  std::jthread thread_;
};

class ServiceImpl : public Service {
 public:
  ServiceImpl(std::string name, const RuntimeOptions& options,
              std::unique_ptr<MessageBus> message_bus)
      : name_(std::move(name)),
        options_(options),
        bus_(std::move(message_bus)),
        started_(clock_.Now()) {}

  MessageBus& bus() override { return *bus_; }
  const Clock& clock() const override { return clock_; }

  void Every(milliseconds period, std::function<void(Instant)> task) override {
    timers_.push_back({period, clock_.Now().steady, std::move(task)});
  }

  void SetHealth(Health state, const std::string& reason) override {
    const std::lock_guard lock(health_mutex_);
    if (state == state_ && reason == reason_) return;
    if (state != state_ || state != Health::kOk) LogChange(state, reason);
    state_ = state;
    reason_ = reason;
  }

  void CountInput(std::int64_t received, std::int64_t refused, std::int64_t dropped) override {
    input_received_ += received;
    input_refused_ += refused;
    input_dropped_ += dropped;
  }

  void OnStop(std::function<void()> task) override { stop_tasks_.push_back(std::move(task)); }
  bool stopping() const override { return stop_requested; }

  void Run() override {
    Every(seconds(1), [this](Instant now) { PublishHealth(now); });
    Watchdog watchdog(options_.watchdog_s);
    LogInfo("running");
    while (!stop_requested) {
      watchdog.Beat();
      Turn();
    }
    LogInfo("ending");
    for (const auto& task : stop_tasks_) Guarded(task);
  }

 private:
  struct Timer {
    milliseconds period;
    microseconds due;
    std::function<void(Instant)> task;
  };

  void Turn() {
    Guarded([this] { bus_->Dispatch(TimeToNextTimer()); });
    const auto busy_from = clock_.Now().steady;
    for (std::size_t i = 0; i < timers_.size(); ++i) {  // a task may add timers
      const Instant now = clock_.Now();
      if (now.steady < timers_[i].due) continue;
      timers_[i].due += timers_[i].period;
      if (timers_[i].due <= now.steady) timers_[i].due = now.steady + timers_[i].period;
      Guarded([&] { timers_[i].task(now); });
    }
    busy_.Add(std::chrono::duration<float, std::milli>(clock_.Now().steady - busy_from).count() +
              bus_->TakeBusyMs());
  }

  milliseconds TimeToNextTimer() const {
    const auto now = clock_.Now().steady;
    microseconds wait = kLongestWait;
    for (const auto& timer : timers_) wait = std::min(wait, timer.due - now);
    return std::max(milliseconds(0), std::chrono::ceil<milliseconds>(wait));
  }

  template <typename Task>
  void Guarded(const Task& task) {
    try {
      task();
    } catch (const std::exception& error) {
      LogError(std::string("in the main loop: ") + error.what());
      std::this_thread::sleep_for(
          milliseconds(10));  // an error that repeats must not fill the disk
    }
  }

  static void LogChange(Health state, const std::string& reason) {
    switch (state) {
      case Health::kOk:
        return LogInfo("healthy");
      case Health::kWaiting:
        return LogInfo("waiting: " + reason);
      case Health::kDegraded:
        return LogWarning("degraded: " + reason);
      case Health::kFailed:
        return LogError("failed: " + reason);
    }
  }

  void PublishHealth(Instant now) {
    service_health_t message{};
    message.utime = now.utime;
    message.service = name_;
    message.pid = getpid();
    message.uptime_s = std::chrono::duration<double>(now.steady - started_.steady).count();
    {
      const std::lock_guard lock(health_mutex_);
      message.state = static_cast<std::int8_t>(state_);
      message.reason = reason_;
    }
    const MessageBus::Counts counts = bus_->counts();
    message.received = counts.received + input_received_;
    message.refused = counts.refused + input_refused_;
    message.dropped = counts.dropped + input_dropped_;
    message.published = counts.published;
    message.loop_p99_ms = busy_.Percentile99();
    busy_.NextSecond();
    bus_->Publish(channels::kHealth, message);
  }

  const std::string name_;
  const RuntimeOptions options_;
  const SystemClock clock_;
  const std::unique_ptr<MessageBus> bus_;
  const Instant started_;
  std::vector<Timer> timers_;
  std::vector<std::function<void()>> stop_tasks_;
  BusyTimes busy_;
  std::mutex health_mutex_;
  Health state_ = Health::kWaiting;
  std::string reason_ = "starting";
  std::atomic<std::int64_t> input_received_ = 0;
  std::atomic<std::int64_t> input_refused_ = 0;
  std::atomic<std::int64_t> input_dropped_ = 0;
};

static_assert(static_cast<int>(Health::kOk) == service_health_t::OK);
static_assert(static_cast<int>(Health::kWaiting) == service_health_t::WAITING);
static_assert(static_cast<int>(Health::kDegraded) == service_health_t::DEGRADED);
static_assert(static_cast<int>(Health::kFailed) == service_health_t::FAILED);

// The network may come up after the service, so a bus that cannot be opened is tried again. Null
// when told to stop meanwhile.
std::unique_ptr<MessageBus> OpenBus(const std::string& url) {
  seconds pause{1};
  while (!stop_requested) {
    try {
      return std::make_unique<MessageBus>(url);
    } catch (const std::runtime_error& error) {
      LogError(std::string(error.what()) + "; next try in " + std::to_string(pause.count()) + " s");
    }
    for (auto waited = milliseconds(0); waited < pause && !stop_requested; waited += kLongestWait) {
      std::this_thread::sleep_for(kLongestWait);
    }
    pause = std::min(2 * pause, seconds(10));
  }
  return nullptr;
}

}  // namespace

namespace internal {

int RunServiceImpl(int argc, char** argv, const ServiceAbout& about,
                   const std::function<void(ConfigFile&)>& read,
                   const std::function<void(Service&)>& run) {
  CLI::App app(about.description, about.name);
  std::filesystem::path config_path;
  std::string lcm_url;
  bool print_config = false;
  std::string log_level = "info";
  app.add_option("--config", config_path, "Configuration of the robot (deploy/robots/*.toml)")
      ->required();
  app.add_option(
      "--lcm-url", lcm_url,
      "LCM network; before the [lcm] url of the configuration, that before $LCM_DEFAULT_URL");
  app.add_flag("--print-config", print_config,
               "Print the configuration that holds, defaults included, and end");
  app.add_option("--log-level", log_level, "Least level that is logged")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitBadConfig;
  }
  const std::map<std::string, LogLevel> levels = {{"debug", LogLevel::kDebug},
                                                  {"info", LogLevel::kInfo},
                                                  {"warning", LogLevel::kWarning},
                                                  {"error", LogLevel::kError}};
  StartLogging(about.name, levels.at(log_level));

  RuntimeOptions options;
  try {
    ConfigFile file(config_path);
    file.IgnoreOtherPrograms();
    options = ReadRuntimeOptions(file);
    ReadRobotOptions(file);  // so that its keys are known to services that need some of them only
    read(file);
    file.Finish();
    if (print_config) {
      std::cout << "# " << about.name << " with " << config_path.string() << "\n"
                << file.Effective();
      return 0;
    }
  } catch (const std::exception& error) {  // ConfigError, FileError
    LogError(error.what());
    return kExitBadConfig;
  }
  if (!lcm_url.empty()) options.lcm_url = lcm_url;

  InstallSignalHandlers();
  CapAddressSpace(options.memory_limit_mb);
  auto bus = OpenBus(options.lcm_url);
  if (!bus) return 0;
  ServiceImpl service(about.name, options, std::move(bus));
  run(service);
  return 0;
}

}  // namespace internal
}  // namespace beckon
