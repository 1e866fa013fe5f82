#include "tests/camera_grabber/stream_server.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

namespace beckon::testing {
namespace {

bool IsReadable(int socket, int timeout_ms) {
  pollfd waiting{socket, POLLIN, 0};
  return poll(&waiting, 1, timeout_ms) > 0;
}

}  // namespace

bool StreamServer::Client::Send(const std::string& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size() && !ending_) {
    const ssize_t result = send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (result <= 0) return false;
    sent += static_cast<std::size_t>(result);
  }
  return !ending_;
}

std::string StreamServer::Client::NextRequest() {
  std::string request;
  char byte = 0;
  while (!request.ends_with("\r\n\r\n")) {
    if (ending_) return "";
    if (!IsReadable(socket_, 20)) continue;
    if (recv(socket_, &byte, 1, 0) <= 0) return "";
    request += byte;
  }
  return request;
}

void StreamServer::Client::Wait() {
  char byte = 0;
  while (!ending_) {
    if (IsReadable(socket_, 20) && recv(socket_, &byte, 1, 0) <= 0) return;
  }
}

StreamServer::StreamServer(Script script, int port)
    : script_(std::move(script)), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int yes = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener_, generic, size) != 0 || listen(listener_, 4) != 0 ||
      getsockname(listener_, generic, &size) != 0) {
    throw std::runtime_error("the test's server cannot listen");
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { Serve(); });
}

StreamServer::~StreamServer() {
  ending_ = true;
  thread_.join();
  close(listener_);
}

void StreamServer::Serve() {
  while (!ending_) {
    if (!IsReadable(listener_, 20)) continue;
    const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (socket < 0) continue;
    Client client(socket, ending_);
    script_(client, connections_++);
    close(socket);
  }
}

}  // namespace beckon::testing
