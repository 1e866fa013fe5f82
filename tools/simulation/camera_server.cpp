#include "tools/simulation/camera_server.hpp"

#include <httplib.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

namespace beckon::simulation {

class CameraServer::Impl {
 public:
  explicit Impl(int port) {
    server_.Get("/stream", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content_provider(
          "multipart/x-mixed-replace; boundary=frame",
          [this, sent = std::uint64_t{0}](std::size_t, httplib::DataSink& sink) mutable {
            return SendNext(sent, sink);
          });
    });
    server_.set_tcp_nodelay(true);
    // Not the library's default, SO_REUSEPORT, with which two cameras would share one port in
    // silence.
    server_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    });
    if (port == 0) {
      port_ = server_.bind_to_any_port("127.0.0.1");
    } else if (server_.bind_to_port("127.0.0.1", port)) {
      port_ = port;
    }
    if (port_ <= 0)
      throw std::runtime_error("the camera's port " + std::to_string(port) + " is taken");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    changed_.notify_all();
    server_.stop();
    thread_.join();
  }

  int port() const { return port_; }

  void Show(Utime captured, std::vector<std::uint8_t> jpeg) {
    char header[160];
    const int length = std::snprintf(header, sizeof(header),
                                     "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: "
                                     "%zu\r\nX-Timestamp: %lld.%06lld\r\n\r\n",
                                     jpeg.size(), static_cast<long long>(captured / 1'000'000),
                                     static_cast<long long>(captured % 1'000'000));
    std::string part(header, static_cast<std::size_t>(length));
    part.append(jpeg.begin(), jpeg.end());
    part.append("\r\n");
    {
      const std::lock_guard lock(mutex_);
      part_ = std::make_shared<const std::string>(std::move(part));
      ++number_;
    }
    changed_.notify_all();
  }

 private:
  bool SendNext(std::uint64_t& sent, httplib::DataSink& sink) {
    std::shared_ptr<const std::string> part;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return ending_ || number_ > sent; });
      if (ending_) return false;
      sent = number_;
      part = part_;
    }
    return sink.write(part->data(), part->size());
  }

  httplib::Server server_;
  int port_ = -1;
  std::thread thread_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<const std::string> part_;
  std::uint64_t number_ = 0;
  bool ending_ = false;
};

CameraServer::CameraServer(int port) : impl_(std::make_unique<Impl>(port)) {}
CameraServer::~CameraServer() = default;
int CameraServer::port() const { return impl_->port(); }
void CameraServer::Show(Utime captured, std::vector<std::uint8_t> jpeg) {
  impl_->Show(captured, std::move(jpeg));
}

}  // namespace beckon::simulation
