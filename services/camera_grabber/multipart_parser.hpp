// Splits a multipart/x-mixed-replace stream (RFC 2046, as network cameras send it) into its parts.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace beckon {

class MultipartParser {
 public:
  struct Part {
    std::map<std::string, std::string> headers;  // names in lower case
    std::vector<std::uint8_t> body;
  };

  // `boundary` as in the Content-Type, with or without the leading dashes that some cameras repeat
  // there.
  explicit MultipartParser(const std::string& boundary);

  // Takes the next bytes of the stream and returns the parts that are complete now. What is not a
  // part is passed over up to the next boundary. Never holds more than kMaxPartBytes.
  std::vector<Part> Feed(std::string_view bytes);

  // Times that a part was given up: headers or body without end, or no boundary where the body
  // should end.
  std::int64_t malformed() const { return malformed_; }

  static constexpr std::size_t kMaxHeaderBytes = 8192;
  static constexpr std::size_t kMaxPartBytes = 16U << 20U;

  // The boundary in "multipart/x-mixed-replace; boundary=..."; empty for any other content type.
  static std::string BoundaryOf(const std::string& content_type);

 private:
  enum class State { kSeekBoundary, kHeaders, kBody };

  bool SeekBoundary();
  bool ReadHeaders();
  bool ReadBody(std::vector<Part>& parts);
  void GiveUpPart();

  const std::string delimiter_;  // "--" and the boundary
  State state_ = State::kSeekBoundary;
  std::string buffer_;
  Part part_;
  std::size_t length_ = 0;  // of the body; 0: up to the next boundary
  std::int64_t malformed_ = 0;
};

}  // namespace beckon
