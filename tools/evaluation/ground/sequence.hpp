// A sequence folder: frames of one camera with truth.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.hpp"
#include "common/frames.hpp"
#include "common/ground_camera.hpp"

namespace beckon {

struct TrueRange {
  double bearing_rad = 0.0;  // counter-clockwise from robot x
  double range_m = 0.0;      // inf where there is nothing
};

struct SequenceFrame {
  std::filesystem::path picture;  // JPEG
  std::filesystem::path
      truth;  // PNG: 0 not judged, 1 ground, 2 not ground; empty where there is none
  Utime utime = 0;
  std::vector<TrueRange> ranges;
  std::optional<Pose2> map_from_robot;
};

struct Sequence {
  std::string name;
  double rate_hz = 10.0;
  GroundCamera camera;
  std::vector<SequenceFrame> frames;  // in order
};

// Throws ConfigError or FileError, naming file and line, for a folder that is not a sequence.
Sequence LoadSequence(const std::filesystem::path& folder);

}  // namespace beckon
