// A site folder: floor plan, beacons, and recorded readings with truth (formats: site.toml,
// calibration.csv, readings.csv, truth.csv).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "common/clock.hpp"
#include "common/floor_plan.hpp"

namespace beckon {

struct Beacon {
  std::string id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, map frame
};

struct Site {
  std::string name;
  FloorPlan plan;
  std::vector<Beacon> beacons;
  double tag_height_m = 1.0;
  double window_s = 2.0;  // readings older than this do not belong to an epoch

  // Reads FOLDER/site.toml and the map image it names. Throws ConfigError, naming file, line and
  // key.
  static Site Load(const std::filesystem::path& folder);

  // Index into `beacons`, -1 for one that the site does not declare.
  int BeaconIndex(const std::string& id) const;
};

// Powers that a radio can report, dBm. Recordings hold others (bytes gone wrong).
inline constexpr double kMinPlausibleRssiDbm = -130.0;
inline constexpr double kMaxPlausibleRssiDbm = 20.0;
inline bool IsPlausibleRssi(double rssi_dbm) {
  return rssi_dbm >= kMinPlausibleRssiDbm && rssi_dbm <= kMaxPlausibleRssiDbm;  // false for NaN
}

struct Reading {
  Utime utime = 0;
  std::string tag;
  std::string beacon;
  double rssi_dbm = 0.0;
};

struct CalibrationReading {
  Reading reading;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  // of the tag, m, map frame
  bool by_robot = false;  // the robot took it, at the place where it believed itself to be
};

struct TruthEpoch {
  Utime utime = 0;
  std::string tag;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  // m, map frame
};

// Each throws FileError, naming file and line; a beacon that the site does not declare is an error.
// Rows with a power that no radio receives are passed over with a warning.
std::vector<Reading> LoadReadings(const std::filesystem::path& file, const Site& site);
std::vector<CalibrationReading> LoadCalibration(const std::filesystem::path& file,
                                                const Site& site);
// The same of what the robot recorded by itself: rows that a loss of power has broken, or that name
// a beacon which is gone, are passed over with a warning.
std::vector<CalibrationReading> LoadRobotCalibration(const std::filesystem::path& file,
                                                     const Site& site);
std::vector<TruthEpoch> LoadTruth(const std::filesystem::path& file);

}  // namespace beckon
