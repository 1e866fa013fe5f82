#include "tools/simulation/xbee_port.hpp"

#include <fcntl.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "services/beacon_reader/xbee_frames.hpp"

namespace beckon::simulation {

std::vector<std::uint8_t> XbeeBytes(const RadioPacket& packet) {
  constexpr std::uint8_t kReceive16 = 0x81;
  constexpr std::size_t kMaxPayload = 100;  // of an 802.15.4 packet
  const unsigned long address = std::stoul(packet.beacon, nullptr, 16);
  std::vector<std::uint8_t> data = {kReceive16, static_cast<std::uint8_t>(address >> 8),
                                    static_cast<std::uint8_t>(address & 0xffU),
                                    static_cast<std::uint8_t>(std::clamp(-packet.rssi_dbm, 0, 255)),
                                    0x00};
  std::size_t payload = 0;
  for (const HeardTag& heard : packet.heard) {
    const std::string line = heard.tag + " " + std::to_string(heard.rssi_dbm) + "\n";
    if (payload + line.size() > kMaxPayload) break;
    payload += line.size();
    data.insert(data.end(), line.begin(), line.end());
  }
  return XbeeFrame(data, XbeeApiMode::kEscaped);
}

XbeePort::XbeePort(const std::filesystem::path& link) : link_(link) {
  std::array<char, 128> name{};
  termios raw{};
  cfmakeraw(&raw);
  if (openpty(&controller_, &terminal_, name.data(), &raw, nullptr) != 0) {
    throw std::runtime_error(std::string("no pseudo-terminal to be had: ") + std::strerror(errno));
  }
  fcntl(controller_, F_SETFL, O_NONBLOCK);
  fcntl(controller_, F_SETFD, FD_CLOEXEC);
  fcntl(terminal_, F_SETFD, FD_CLOEXEC);
  std::error_code error;
  if (std::filesystem::is_symlink(link_)) std::filesystem::remove(link_, error);
  if (link_.has_parent_path()) std::filesystem::create_directories(link_.parent_path(), error);
  error.clear();
  terminal_name_ = name.data();
  std::filesystem::create_symlink(terminal_name_, link_, error);
  if (error) {
    close(controller_);
    close(terminal_);
    throw std::runtime_error("cannot make the link " + link_.string() + ": " + error.message());
  }
}

XbeePort::~XbeePort() {
  // Another simulation may have taken the link over.
  std::error_code error;
  if (std::filesystem::read_symlink(link_, error) == terminal_name_) {
    std::filesystem::remove(link_, error);
  }
  close(controller_);
  close(terminal_);
}

void XbeePort::Write(const std::vector<std::uint8_t>& bytes) {
  // A reader that is not there leaves the terminal's buffer full. Old bytes are of no use to the
  // next one: away with them.
  if (write(controller_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) {
    tcflush(terminal_, TCIFLUSH);
  }
  std::array<char, 256> sink{};
  while (read(controller_, sink.data(), sink.size()) > 0) {
  }
}

}  // namespace beckon::simulation
