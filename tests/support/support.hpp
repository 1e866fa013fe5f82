// Small things that many tests need.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "common/message_bus.hpp"

namespace beckon::testing {

// A new empty folder, removed at the end of its life.
class TempDir {
 public:
  TempDir();
  ~TempDir();
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;
  const std::filesystem::path& path() const { return path_; }
  // Writes a file in it and returns its path.
  std::filesystem::path Write(const std::string& name, const std::string& text) const;

 private:
  std::filesystem::path path_;
};

// The repository, and where its programs were built.
std::filesystem::path SourceDir();
std::filesystem::path BinDir();

// The recorded data beside the checkout, ../shared/data, or $BECKON_DATA; empty where there is
// none. Tests that need it: `if (SharedData().empty()) GTEST_SKIP() << kNoSharedData;`
std::filesystem::path SharedData();
inline constexpr char kNoSharedData[] =
    "no recorded data beside the checkout (../shared/data or $BECKON_DATA)";

// Lets LCM work until `done` says so; false when it does not within the timeout.
bool DispatchUntil(MessageBus& bus, const std::function<bool()>& done,
                   std::chrono::milliseconds timeout = std::chrono::seconds(10));

// Collects every message of a channel.
template <typename T>
class Collector {
 public:
  Collector(MessageBus& bus, const std::string& channel) {
    bus.Subscribe<T>(channel, [this](const T& message) { messages_.push_back(message); });
  }
  const std::vector<T>& messages() const { return messages_; }
  std::size_t size() const { return messages_.size(); }
  void Clear() { messages_.clear(); }

 private:
  std::vector<T> messages_;
};

// Puts raw bytes on a channel, well-formed or not.
void PublishRaw(const std::string& channel, const std::vector<std::uint8_t>& bytes);

}  // namespace beckon::testing
