// One drive of a robot that does not know where it is: a random furnished flat, the libraries of
// rssi_localizer called directly, faster than real time.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "services/rssi_localizer/robot_localizer.hpp"

namespace beckon {

inline constexpr double kRightM = 0.3;  // a pose within both is right
inline constexpr double kRightDeg = 5.0;
inline constexpr double kWrongM = 0.5;  // and beyond one of these it is wrong
inline constexpr double kWrongDeg = 10.0;

struct PoseDriveOptions {
  double find_m = 10.0;       // driven from the unknown start until it is judged
  double track_m = 10.0;      // driven on, known or not
  bool is_carried = false;    // then carried elsewhere,
  double recover_m = 15.0;    // and driven until it is judged again
  bool has_odometry = true;   // else the motion of the ground, as a camera tells it
  double max_time_s = 400.0;  // of each part, for robots that somebody stands in the way of
  RobotLocalizerOptions localizer;
};

// From not knowing to the moment at which it is judged.
struct Search {
  bool is_right = false;    // a pose is given, and it is right, at that moment
  bool is_located = false;  // a pose is given then
  double error_m = std::numeric_limits<double>::quiet_NaN();  // at that moment, where located
  double error_deg = std::numeric_limits<double>::quiet_NaN();
  double driven_m = 0.0;  // until then; less than asked for where somebody stood in the way
  double found_m = std::numeric_limits<double>::infinity();  // driven when it was first right
  double found_s = std::numeric_limits<double>::infinity();  // and the time it took
};

struct PoseDrive {
  std::uint64_t seed = 0;
  Search start;
  Search recovery;               // where it was carried away
  std::vector<double> errors_m;  // of the poses given after the first part, ten a second
  std::vector<double> errors_deg;
  double time_s = 0.0;         // of the whole drive
  double located_s = 0.0;      // with a pose given
  double wrong_s = 0.0;        // with a wrong pose given
  double cpu_searching = 0.0;  // processor seconds a second of the drive
  double cpu_located = 0.0;
};

PoseDrive RunPoseDrive(std::uint64_t seed, const PoseDriveOptions& options);

}  // namespace beckon
