#include "services/camera_grabber/multipart_parser.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace beckon {
namespace {

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n\"");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n\"") - first + 1);
}

// Whether the text ends with at least three characters with which `border` begins.
bool EndsLikeStartOf(std::string_view border, std::string_view text) {
  for (std::size_t length = border.size() - 1; length >= 3; --length) {
    if (text.ends_with(border.substr(0, length))) return true;
  }
  return false;
}

}  // namespace

std::string MultipartParser::BoundaryOf(const std::string& content_type) {
  if (!LowerCase(content_type).starts_with("multipart/x-mixed-replace")) return "";
  const auto at = LowerCase(content_type).find("boundary=");
  if (at == std::string::npos) return "";
  std::string_view value = std::string_view(content_type).substr(at + 9);
  return std::string(Trimmed(value.substr(0, value.find(';'))));
}

MultipartParser::MultipartParser(const std::string& boundary)
    : delimiter_(boundary.starts_with("--") ? boundary : "--" + boundary) {}

std::vector<MultipartParser::Part> MultipartParser::Feed(std::string_view bytes) {
  buffer_.append(bytes);
  std::vector<Part> parts;
  bool goes_on = true;
  while (goes_on) {
    switch (state_) {
      case State::kSeekBoundary:
        goes_on = SeekBoundary();
        break;
      case State::kHeaders:
        goes_on = ReadHeaders();
        break;
      case State::kBody:
        goes_on = ReadBody(parts);
        break;
    }
  }
  return parts;
}

bool MultipartParser::SeekBoundary() {
  const auto at = buffer_.find(delimiter_);
  if (at == std::string::npos) {
    // The boundary may have begun in what is here.
    const std::size_t keep = std::min(buffer_.size(), delimiter_.size() - 1);
    buffer_.erase(0, buffer_.size() - keep);
    return false;
  }
  const auto line_end = buffer_.find('\n', at);
  if (line_end == std::string::npos) {
    if (buffer_.size() - at > kMaxHeaderBytes) buffer_.erase(0, at + delimiter_.size());
    return false;
  }
  buffer_.erase(0, line_end + 1);
  part_ = {};
  state_ = State::kHeaders;
  return true;
}

bool MultipartParser::ReadHeaders() {
  const auto line_end = buffer_.find('\n');
  if (line_end == std::string::npos || line_end > kMaxHeaderBytes) {
    if (buffer_.size() <= kMaxHeaderBytes) return false;
    GiveUpPart();
    return true;
  }
  const std::string line(Trimmed(std::string_view(buffer_).substr(0, line_end)));
  buffer_.erase(0, line_end + 1);
  if (!line.empty()) {
    const auto colon = line.find(':');
    if (colon == std::string::npos || part_.headers.size() > 64) {
      GiveUpPart();
      return true;
    }
    part_.headers[LowerCase(Trimmed(line.substr(0, colon)))] = Trimmed(line.substr(colon + 1));
    return true;
  }
  length_ = 0;
  if (const auto found = part_.headers.find("content-length"); found != part_.headers.end()) {
    const std::string& text = found->second;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), length_);
    if (result.ec != std::errc{} || length_ > kMaxPartBytes) {
      GiveUpPart();
      return true;
    }
  }
  state_ = State::kBody;
  return true;
}

bool MultipartParser::ReadBody(std::vector<Part>& parts) {
  std::size_t end = length_;
  if (length_ > 0) {
    if (buffer_.size() < length_) return false;
  } else {
    end = buffer_.find("\n" + delimiter_);
    if (end == std::string::npos) {
      if (buffer_.size() <= kMaxPartBytes) return false;
      GiveUpPart();
      return true;
    }
    if (end > 0 && buffer_[end - 1] == '\r') --end;
  }
  // A part that was cut short takes the beginning of the next for its own: a boundary begins inside
  // it, and the stream is read again from there. To see a boundary that reaches beyond the body
  // takes the bytes after it, which are waited for only if the body ends as a boundary begins.
  const std::string border = "\n" + delimiter_;
  const std::size_t inside = std::string_view(buffer_).find(border);
  if (inside < end) {
    buffer_.erase(0, inside);
    ++malformed_;
  } else if (length_ > 0 && EndsLikeStartOf(border, std::string_view(buffer_).substr(0, end)) &&
             buffer_.size() < end + border.size()) {
    return false;
  } else {
    part_.body.assign(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(end));
    buffer_.erase(0, end);
    parts.push_back(std::move(part_));
  }
  state_ = State::kSeekBoundary;
  return true;
}

void MultipartParser::GiveUpPart() {
  ++malformed_;
  state_ = State::kSeekBoundary;
  if (buffer_.size() > kMaxHeaderBytes) buffer_.erase(0, buffer_.size() - kMaxHeaderBytes);
}

}  // namespace beckon
