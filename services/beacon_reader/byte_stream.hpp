// An open device: serial port, named pipe, file, or TCP connection, all read the same way.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace beckon {

class ByteStream {
 public:
  // `device`: "tcp:HOST:PORT", or a path. A terminal is set to raw mode, 8N1, at this baud rate,
  // and what it received before is thrown away. Throws std::runtime_error that says what is wrong
  // with which device.
  ByteStream(const std::string& device, int baud);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  // Waits for bytes, no longer than `timeout`, and returns them; none where none came. Throws
  // std::runtime_error when the device has gone. A file is waited on for what is appended to it.
  std::vector<std::uint8_t> Read(std::chrono::milliseconds timeout);
  // Throws std::runtime_error when the device has gone.
  void Write(std::span<const std::uint8_t> bytes);

 private:
  [[noreturn]] void Fail(const std::string& what) const;

  std::string device_;
  int fd_ = -1;
  bool is_file_ = false;
};

// Whether this is a baud rate that a terminal can be set to.
bool IsBaudRate(int baud);
// Splits "tcp:HOST:PORT"; false where `device` is not of that form.
bool SplitTcp(const std::string& device, std::string& host, std::string& port);

}  // namespace beckon
