// The lines that base_adapter and a robot base exchange: text, so that a terminal program can speak
// it, each line with a checksum, so that a bit gone wrong is not a metre a second.
//
//   V LINEAR ANGULAR*CS   to the base: velocity, m/s and rad/s
//   O X Y THETA*CS        from the base: odometry of the axle's middle, m, m, rad
//
// CS: two hexadecimal digits, exclusive or of all characters before the star. Lines end with a line
// feed; a carriage return before it is allowed.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/frames.hpp"

namespace beckon {

// "BODY*CS\n".
std::string ChecksummedLine(std::string_view body);
std::string VelocityLine(double linear_mps, double angular_radps);

// Puts odometry lines together from bytes, however they are cut into pieces.
class OdometryReader {
 public:
  struct Counts {
    std::int64_t accepted = 0;
    std::int64_t refused = 0;  // wrong checksum, too long, no numbers; lines with '#' do not count
  };

  // odometry_from_base of the lines that these bytes complete.
  std::vector<Pose2> Push(std::span<const std::uint8_t> bytes);
  // The device was opened anew: what began before does not go on.
  void Restart();

  const Counts& counts() const { return counts_; }

 private:
  std::string line_;
  bool is_cut_ = true;  // nobody knows what stood before
  Counts counts_;
};

}  // namespace beckon
