// A base's side of the contract, free of LCM and devices: what it is told and what it tells.
#pragma once

#include <optional>

#include "common/clock.hpp"
#include "common/config.hpp"
#include "common/robot_file.hpp"
#include "tools/base_adapter/line_protocol.hpp"

namespace beckon {

struct BaseAdapterOptions {
  std::string device;  // serial port, or "tcp:HOST:PORT"
  int baud = 115200;
  double command_timeout_s = 0.3;
  RobotOptions robot;
};
BaseAdapterOptions ReadBaseAdapterOptions(ConfigFile& file);

struct Drive {
  double linear_mps = 0.0;
  double angular_radps = 0.0;
};

// The newest DRIVE, for as long as it holds.
class CommandKeeper {
 public:
  explicit CommandKeeper(const BaseAdapterOptions& options) : options_(options) {}

  // Throws std::invalid_argument for numbers that are none, and stops.
  void Set(Instant now, Utime utime, const Drive& drive);
  // Within the robot's limits; a stop where the newest command was given, or has arrived, longer
  // than the timeout ago.
  Drive At(Instant now) const;

 private:
  struct Command {
    Instant arrived;
    Utime utime;
    Drive drive;
  };
  BaseAdapterOptions options_;
  std::optional<Command> command_;
};

// From the axle's poses to ODOMETRY, which is of the robot frame.
class OdometryKeeper {
 public:
  struct Report {
    Pose2 odometry_from_robot;
    double forward_mps = 0.0;  // of the axle, since the last line
    double turn_radps = 0.0;
  };
  explicit OdometryKeeper(const RobotOptions& robot) : robot_(robot) {}
  Report Add(Instant now, const Pose2& odometry_from_base);

 private:
  RobotOptions robot_;
  std::optional<Instant> at_;
  Pose2 last_;
};

}  // namespace beckon
