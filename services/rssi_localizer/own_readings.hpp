// Self-calibration: what the robot's own tag hears while the robot knows where it is, kept in a
// file in the form of calibration.csv. The next start uses it where held-back readings say that it
// helps (model_selection.hpp).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <optional>

#include "common/site.hpp"

namespace beckon {

class OwnReadings {
 public:
  static constexpr int kMostReadings = 20'000;  // in the file; more would make starts slow
  static constexpr double kStepM = 0.5;

  // Begins the file, or goes on with one that holds `known` readings. Throws FileError where it
  // cannot be written.
  OwnReadings(const std::filesystem::path& file, int known, double window_s);

  // A reading of the robot's tag, and where the robot was on the map. Readings are taken for the
  // length of a window, and then none until the robot has moved on by kStepM: where it stands it
  // learns nothing new. False for a failure to write, which is logged; then nothing more is kept.
  bool Add(const Reading& reading, const Eigen::Vector2d& position);

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
  int count_;
  Utime window_us_;
  Utime window_end_ = 0;
  std::optional<Eigen::Vector2d> taken_at_;
};

}  // namespace beckon
