#include "tools/base_adapter/line_protocol.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>

namespace beckon {
namespace {

constexpr std::size_t kMaxLine = 128;

unsigned Checksum(std::string_view body) {
  unsigned sum = 0;
  for (const char character : body) sum ^= static_cast<unsigned char>(character);
  return sum;
}

// The part before the star; nothing where the checksum is missing or wrong.
std::optional<std::string_view> Body(std::string_view line) {
  const std::size_t star = line.rfind('*');
  if (star == std::string_view::npos || line.size() != star + 3) return std::nullopt;
  unsigned told = 0;
  const auto [end, error] = std::from_chars(&line[star + 1], line.data() + line.size(), told, 16);
  if (error != std::errc() || end != line.data() + line.size()) return std::nullopt;
  const std::string_view body = line.substr(0, star);
  return told == Checksum(body) ? std::optional(body) : std::nullopt;
}

// "O X Y THETA".
std::optional<Pose2> ParseOdometry(std::string_view body) {
  if (!body.starts_with("O ")) return std::nullopt;
  std::array<double, 3> numbers{};
  const char* at = body.data() + 1;
  const char* const end = body.data() + body.size();
  for (double& number : numbers) {
    if (at == end || *at != ' ') return std::nullopt;
    const auto [after, error] = std::from_chars(at + 1, end, number);
    if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
    at = after;
  }
  if (at != end) return std::nullopt;
  return Pose2{numbers[0], numbers[1], WrapAngle(numbers[2])};
}

}  // namespace

std::string ChecksummedLine(std::string_view body) {
  std::array<char, 8> tail{};
  std::snprintf(tail.data(), tail.size(), "*%02X\n", Checksum(body));
  return std::string(body) + tail.data();
}

std::string VelocityLine(double linear_mps, double angular_radps) {
  std::array<char, 64> body{};
  std::snprintf(body.data(), body.size(), "V %.4f %.4f", linear_mps, angular_radps);
  return ChecksummedLine(body.data());
}

std::vector<Pose2> OdometryReader::Push(std::span<const std::uint8_t> bytes) {
  std::vector<Pose2> poses;
  for (const std::uint8_t byte : bytes) {
    if (byte != '\n') {
      if (line_.size() < kMaxLine) {
        line_.push_back(static_cast<char>(byte));
      } else {
        is_cut_ = true;
      }
      continue;
    }
    if (line_.ends_with('\r')) line_.pop_back();
    const auto body = Body(line_);
    const auto pose = body ? ParseOdometry(*body) : std::nullopt;
    if (pose) {
      poses.push_back(*pose);
      ++counts_.accepted;
    } else if (!is_cut_ || line_.size() >= kMaxLine) {
      counts_.refused += line_.empty() || line_.starts_with('#') ? 0 : 1;
    }
    line_.clear();
    is_cut_ = false;
  }
  return poses;
}

void OdometryReader::Restart() {
  line_.clear();
  is_cut_ = true;
}

}  // namespace beckon
