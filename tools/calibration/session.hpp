// What a person has photographed and measured, as files.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "tools/calibration/lens.hpp"
#include "tools/calibration/mount.hpp"

namespace beckon {

struct SessionOptions {
  std::filesystem::path input;    // .toml: a session; .csv: marks alone
  std::filesystem::path picture;  // of the floor with the marks; for its size, and to draw on
  std::filesystem::path lens;     // calibration whose lens is taken over
  std::optional<double> camera_height_m;
};

struct Session {
  MountInput mount;
  std::size_t lens_pictures = 0;  // that the lens was calibrated from; 0: none, or taken over
  cv::Mat picture;                // CV_8UC3, of the floor
};

// Reads the files, finds the boards in the pictures, and calibrates the lens where there are
// pictures for it. Throws ConfigError, FileError or CalibrationError, naming file and line.
Session ReadSession(const SessionOptions& options);

}  // namespace beckon
