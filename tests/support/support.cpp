#include "tests/support/support.hpp"

#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace beckon::testing {

TempDir::TempDir() {
  std::string pattern = (std::filesystem::temp_directory_path() / "beckon_test_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = pattern;
}

TempDir::~TempDir() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path TempDir::Write(const std::string& name, const std::string& text) const {
  const auto file = path_ / name;
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << text;
  return file;
}

std::filesystem::path SourceDir() { return BECKON_SOURCE_DIR; }

std::filesystem::path BinDir() { return BECKON_BIN_DIR; }

std::filesystem::path SharedData() {
  const char* from_environment = std::getenv("BECKON_DATA");
  const std::filesystem::path folder = from_environment != nullptr
                                           ? std::filesystem::path(from_environment)
                                           : SourceDir() / "../shared/data";
  return std::filesystem::is_directory(folder) ? folder.lexically_normal()
                                               : std::filesystem::path();
}

bool DispatchUntil(MessageBus& bus, const std::function<bool()>& done,
                   std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (!done()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    bus.Dispatch(std::chrono::milliseconds(20));
  }
  return true;
}

void PublishRaw(const std::string& channel, const std::vector<std::uint8_t>& bytes) {
  lcm::LCM lcm(kDefaultLcmUrl);
  if (lcm.publish(channel, bytes.data(), static_cast<unsigned>(bytes.size())) != 0) {
    throw std::runtime_error("LCM could not send");
  }
}

}  // namespace beckon::testing
