// LCM with the guards that its generated code lacks, in one place.
//
// A payload with a valid fingerprint but a bad array count makes generated decode functions throw
// or ask for gigabytes. Here a message is accepted only when it decodes without an exception and to
// its last byte; the rest is counted and reported. The service runtime caps the address space as
// well.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/log.hpp"

namespace beckon {

// ttl=0: this host only. recv_buf_size: at the kernel's default of 208 KiB a camera frame loses.
inline constexpr char kDefaultLcmUrl[] = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

// Decodes one message of type T. False for anything but exactly one well-formed T.
template <typename T>
bool DecodeExactly(const void* data, std::size_t size, T& message) {
  try {
    if (size > static_cast<std::size_t>(std::numeric_limits<int>::max())) return false;
    return message.decode(data, 0, static_cast<int>(size)) == static_cast<int>(size);
  } catch (const std::exception&) {  // std::bad_alloc, std::length_error
    return false;
  }
}

class MessageBus {
 public:
  struct Counts {
    std::int64_t received = 0;  // accepted and handed to a handler
    std::int64_t refused = 0;   // not decodable, or a handler threw over its content
    std::int64_t dropped = 0;   // replaced by a newer one before it was looked at
    std::int64_t published = 0;
  };

  // Any LCM URL: udpm://, memq://, file://. Throws std::runtime_error where LCM cannot be opened,
  // with what to do about it.
  explicit MessageBus(const std::string& url);
  ~MessageBus();
  MessageBus(const MessageBus&) = delete;
  MessageBus& operator=(const MessageBus&) = delete;

  // Every message in the order of arrival. A handler refuses a message that is well-formed but
  // makes no sense by throwing std::invalid_argument.
  template <typename T>
  void Subscribe(const std::string& channel, std::function<void(const T&)> handler) {
    Add(channel, false, Decoder<T>(channel, std::move(handler)));
  }

  // Only the newest message that has arrived when the process has time for it: for state and
  // images.
  template <typename T>
  void SubscribeLatest(const std::string& channel, std::function<void(const T&)> handler) {
    Add(channel, true, Decoder<T>(channel, std::move(handler)));
  }

  // Safe to call from any thread.
  template <typename T>
  void Publish(const std::string& channel, const T& message) {
    std::vector<std::uint8_t> buffer(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(buffer.data(), 0, static_cast<int>(buffer.size()));
    PublishBytes(channel, buffer);
  }

  // Waits up to `timeout` for messages, hands on all that have arrived, and returns whether there
  // were any. Throws std::runtime_error when LCM itself fails. A file:// log gives one message a
  // call, and nothing after its end.
  bool Dispatch(std::chrono::milliseconds timeout);

  Counts counts() const;

  // Time spent in handlers since the last call of this function, ms: what a turn of the loop cost
  // without the time it waited.
  float TakeBusyMs();

 private:
  struct Subscription;
  using Handler = std::function<bool(const void* data, std::size_t size)>;

  template <typename T>
  static Handler Decoder(const std::string& channel, std::function<void(const T&)> handler) {
    return [channel, handler = std::move(handler)](const void* data, std::size_t size) {
      T message{};
      if (!DecodeExactly(data, size, message)) {
        Report(channel, "is not a well-formed " + std::string(T::getTypeName()));
        return false;
      }
      try {
        handler(message);
        return true;
      } catch (const std::exception& error) {
        // No exception may pass through LCM's C code, and no message may end a service.
        Report(channel, std::string("refused: ") + error.what());
        return false;
      }
    };
  }

  static void Report(const std::string& channel, const std::string& what);
  void Add(const std::string& channel, bool latest_only, Handler handler);
  void PublishBytes(const std::string& channel, const std::vector<std::uint8_t>& bytes);
  void OnRaw(Subscription& subscription, const lcm::ReceiveBuffer& buffer);
  void Deliver(Subscription& subscription, const void* data, std::size_t size);

  std::unique_ptr<lcm::LCM> lcm_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  bool is_log_ = false;
  std::chrono::steady_clock::duration busy_{};
  struct Counters;
  std::unique_ptr<Counters> counters_;
};

}  // namespace beckon
