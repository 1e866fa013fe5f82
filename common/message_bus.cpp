#include "common/message_bus.hpp"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace beckon {

namespace {

// So many messages at most are taken in one turn of the loop, so that a flood cannot keep timers
// waiting.
constexpr int kMaxMessagesPerDispatch = 1000;

// Complaints about one channel are logged at most this often.
constexpr std::chrono::seconds kReportPeriod{5};

}  // namespace

struct MessageBus::Counters {
  std::atomic<std::int64_t> received = 0;
  std::atomic<std::int64_t> refused = 0;
  std::atomic<std::int64_t> dropped = 0;
  std::atomic<std::int64_t> published = 0;
};

struct MessageBus::Subscription {
  MessageBus* bus;
  bool latest_only;
  Handler handler;
  std::vector<std::uint8_t> newest;
  bool has_newest = false;

  void OnRaw(const lcm::ReceiveBuffer* buffer, const std::string&) { bus->OnRaw(*this, *buffer); }
};

MessageBus::MessageBus(const std::string& url)
    : lcm_(std::make_unique<lcm::LCM>(url)),
      is_log_(url.starts_with("file://")),
      counters_(std::make_unique<Counters>()) {
  if (!lcm_->good()) {
    throw std::runtime_error(
        "LCM cannot be opened at '" + url + "'" +
        (url.starts_with("udpm://")
             ? ": is there a multicast route? On a machine without a network: ip link set "
               "lo multicast on; ip route add 224.0.0.0/4 dev lo"
             : ""));
  }
}

MessageBus::~MessageBus() = default;

void MessageBus::Add(const std::string& channel, bool latest_only, Handler handler) {
  // A log is read from beginning to end and nothing in it is late.
  subscriptions_.push_back(std::make_unique<Subscription>(
      Subscription{this, latest_only && !is_log_, std::move(handler), {}, false}));
  Subscription* subscription = subscriptions_.back().get();
  // LCM takes channel names as regular expressions; ours are plain words.
  lcm::Subscription* raw = lcm_->subscribe(channel, &Subscription::OnRaw, subscription);
  raw->setQueueCapacity(kMaxMessagesPerDispatch);
}

void MessageBus::OnRaw(Subscription& subscription, const lcm::ReceiveBuffer& buffer) {
  if (subscription.latest_only) {
    const auto* bytes = static_cast<const std::uint8_t*>(buffer.data);
    if (subscription.has_newest) ++counters_->dropped;
    subscription.newest.assign(bytes, bytes + buffer.data_size);
    subscription.has_newest = true;
  } else {
    Deliver(subscription, buffer.data, buffer.data_size);
  }
}

void MessageBus::Deliver(Subscription& subscription, const void* data, std::size_t size) {
  const auto start = std::chrono::steady_clock::now();
  if (subscription.handler(data, size)) {
    ++counters_->received;
  } else {
    ++counters_->refused;
  }
  busy_ += std::chrono::steady_clock::now() - start;
}

bool MessageBus::Dispatch(std::chrono::milliseconds timeout) {
  if (is_log_) {
    const int status = lcm_->handleTimeout(static_cast<int>(timeout.count()));
    // At the end of a log LCM reports an error at once, and again and again.
    if (status < 0) std::this_thread::sleep_for(timeout);
    return status > 0;
  }
  int wait_ms = static_cast<int>(timeout.count());
  int handled = 0;
  while (handled < kMaxMessagesPerDispatch) {
    const int status = lcm_->handleTimeout(wait_ms);
    if (status < 0 && errno != EINTR) {
      throw std::runtime_error(std::string("LCM failed while waiting for messages: ") +
                               std::strerror(errno));
    }
    if (status <= 0) break;
    ++handled;
    wait_ms = 0;
  }
  for (const auto& subscription : subscriptions_) {
    if (!subscription->has_newest) continue;
    subscription->has_newest = false;
    Deliver(*subscription, subscription->newest.data(), subscription->newest.size());
  }
  return handled > 0;
}

void MessageBus::PublishBytes(const std::string& channel, const std::vector<std::uint8_t>& bytes) {
  if (lcm_->publish(channel, bytes.data(), static_cast<unsigned>(bytes.size())) != 0) {
    Report(channel, "could not be sent");
    return;
  }
  ++counters_->published;
}

MessageBus::Counts MessageBus::counts() const {
  return {counters_->received, counters_->refused, counters_->dropped, counters_->published};
}

float MessageBus::TakeBusyMs() {
  const float busy_ms = std::chrono::duration<float, std::milli>(busy_).count();
  busy_ = {};
  return busy_ms;
}

void MessageBus::Report(const std::string& channel, const std::string& what) {
  static std::mutex mutex;
  static std::map<std::string, std::pair<std::chrono::steady_clock::time_point, int>> last_reports;
  const std::lock_guard lock(mutex);
  const auto now = std::chrono::steady_clock::now();
  const auto [entry, is_new] = last_reports.try_emplace(channel, now, 0);
  auto& [last, suppressed] = entry->second;
  if (!is_new && now - last < kReportPeriod) {
    ++suppressed;
    return;
  }
  LogWarning("message on " + channel + " " + what +
             (suppressed > 0 ? " (and " + std::to_string(suppressed) + " more like this)" : ""));
  last = now;
  suppressed = 0;
}

}  // namespace beckon
