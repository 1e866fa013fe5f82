#include "services/beacon_reader/byte_stream.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <memory>
#include <stdexcept>
#include <thread>

namespace beckon {
namespace {

const std::map<int, speed_t>& BaudRates() {
  static const std::map<int, speed_t> rates = {
      {1200, B1200},     {2400, B2400},     {4800, B4800},     {9600, B9600},
      {19200, B19200},   {38400, B38400},   {57600, B57600},   {115200, B115200},
      {230400, B230400}, {460800, B460800}, {921600, B921600}, {1000000, B1000000}};
  return rates;
}

// libserialport knows ports by their place in sysfs and refuses pseudo-terminals and links to
// ports, which udev rules make; a raw terminal needs no more than this.
void SetRaw(int fd, int baud) {
  termios settings{};
  if (tcgetattr(fd, &settings) != 0) throw std::runtime_error(std::strerror(errno));
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  cfsetspeed(&settings, BaudRates().at(baud));
  if (tcsetattr(fd, TCSANOW, &settings) != 0) throw std::runtime_error(std::strerror(errno));
  tcflush(fd, TCIFLUSH);
}

// A peer that loses power says nothing; the kernel then finds out, in some ten seconds and not, as
// by default, in two hours.
void KeepAlive(int fd) {
  const auto set = [fd](int level, int option, int value) {
    setsockopt(fd, level, option, &value, sizeof value);
  };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 4);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 2);
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
}

int ConnectTcp(const std::string& host, const std::string& port) {
  constexpr int kTimeoutMs = 3000;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0) {
    throw std::runtime_error(gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(found, freeaddrinfo);
  std::string reason = "no address";
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    const int fd = socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) continue;
    int error = 0;
    if (connect(fd, address->ai_addr, address->ai_addrlen) != 0) {
      error = errno;
      pollfd writable{fd, POLLOUT, 0};
      if (error == EINPROGRESS) {
        socklen_t size = sizeof error;
        error = poll(&writable, 1, kTimeoutMs) == 1 ? 0 : ETIMEDOUT;
        if (error == 0) getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
      }
    }
    if (error == 0) {
      KeepAlive(fd);
      return fd;
    }
    reason = std::strerror(error);
    close(fd);
  }
  throw std::runtime_error(reason);
}

}  // namespace

bool IsBaudRate(int baud) { return BaudRates().contains(baud); }

bool SplitTcp(const std::string& device, std::string& host, std::string& port) {
  if (!device.starts_with("tcp:")) return false;
  const std::size_t colon = device.rfind(':');
  if (colon <= 4 || colon + 1 == device.size()) return false;
  host = device.substr(4, colon - 4);
  port = device.substr(colon + 1);
  return true;
}

ByteStream::ByteStream(const std::string& device, int baud) : device_(device) {
  try {
    std::string host;
    std::string port;
    if (SplitTcp(device, host, port)) {
      fd_ = ConnectTcp(host, port);
      return;
    }
    struct stat status {};
    if (stat(device.c_str(), &status) != 0) throw std::runtime_error(std::strerror(errno));
    is_file_ = S_ISREG(status.st_mode);
    // A pipe is opened for writing too, so that it does not end whenever a writer goes.
    const int access = is_file_ ? O_RDONLY : O_RDWR;
    fd_ = open(device.c_str(), access | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0) throw std::runtime_error(std::strerror(errno));
    if (isatty(fd_) != 0) SetRaw(fd_, baud);
  } catch (const std::runtime_error& error) {
    if (fd_ >= 0) close(fd_);
    throw std::runtime_error("cannot open " + device + ": " + error.what());
  }
}

ByteStream::~ByteStream() { close(fd_); }

void ByteStream::Fail(const std::string& what) const {
  throw std::runtime_error(device_ + " has gone: " + what);
}

std::vector<std::uint8_t> ByteStream::Read(std::chrono::milliseconds timeout) {
  pollfd readable{fd_, POLLIN, 0};
  const int ready = poll(&readable, 1, static_cast<int>(timeout.count()));
  if (ready < 0 && errno != EINTR) Fail(std::strerror(errno));
  if (ready <= 0) return {};
  std::vector<std::uint8_t> bytes(4096);
  const ssize_t count = read(fd_, bytes.data(), bytes.size());
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  if (count < 0) Fail(std::strerror(errno));
  if (count == 0 && !is_file_) Fail("end of stream");
  // poll() calls a file readable at its end as well.
  if (count == 0) std::this_thread::sleep_for(timeout);
  bytes.resize(static_cast<std::size_t>(count));
  return bytes;
}

void ByteStream::Write(std::span<const std::uint8_t> bytes) {
  // What does not fit is dropped: a request for a power that is not asked for at once is of no use
  // later. To a connection that was closed, send() does not raise SIGPIPE.
  ssize_t count = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (count < 0 && errno == ENOTSOCK) count = write(fd_, bytes.data(), bytes.size());
  if (count < 0 && errno != EAGAIN && errno != EINTR) Fail(std::strerror(errno));
}

}  // namespace beckon
