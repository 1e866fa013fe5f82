// A network camera that does what it is told, well or badly: one TCP client at a time.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>

namespace beckon::testing {

class StreamServer {
 public:
  // What to do with a client whose request has been read; the connection closes when it returns.
  class Client {
   public:
    explicit Client(int socket, const std::atomic<bool>& ending)
        : socket_(socket), ending_(ending), first_request_(NextRequest()) {}
    const std::string& first_request() const { return first_request_; }
    // The next one, up to its blank line; empty when the client has gone or the server is to end.
    std::string NextRequest();
    // False when the client has gone or the server is to end.
    bool Send(const std::string& bytes);
    // Says nothing until the client goes or the server is to end.
    void Wait();
    bool ending() const { return ending_; }

   private:
    int socket_;
    const std::atomic<bool>& ending_;
    std::string first_request_;
  };
  using Script = std::function<void(Client& client, int connection)>;  // connections count from 0

  // Port 0: any free one.
  explicit StreamServer(Script script, int port = 0);
  ~StreamServer();
  StreamServer(const StreamServer&) = delete;
  StreamServer& operator=(const StreamServer&) = delete;

  int port() const { return port_; }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_) + "/stream"; }
  int connections() const { return connections_; }

  static constexpr char kHeader[] =
      "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n";

 private:
  void Serve();

  const Script script_;
  int listener_ = -1;
  int port_ = 0;
  std::atomic<bool> ending_ = false;
  std::atomic<int> connections_ = 0;
  std::thread thread_;
};

}  // namespace beckon::testing
