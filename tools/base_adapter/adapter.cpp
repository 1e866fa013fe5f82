#include "tools/base_adapter/adapter.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "services/beacon_reader/byte_stream.hpp"

namespace beckon {

BaseAdapterOptions ReadBaseAdapterOptions(ConfigFile& file) {
  BaseAdapterOptions options;
  options.robot = ReadRobotOptions(file);
  ConfigTable& table = file.Table("base_adapter");
  table.Required("device", options.device);
  table.Optional("baud", options.baud);
  if (!IsBaudRate(options.baud)) table.Fail("baud", "is not a baud rate of terminals");
  table.Optional("command_timeout_s", options.command_timeout_s, Range{0.05, 0.3});
  return options;
}

void CommandKeeper::Set(Instant now, Utime utime, const Drive& drive) {
  command_.reset();
  if (!std::isfinite(drive.linear_mps) || !std::isfinite(drive.angular_radps)) {
    throw std::invalid_argument("the command is not finite");
  }
  command_ = Command{now, utime, drive};
}

Drive CommandKeeper::At(Instant now) const {
  if (!command_ || SecondsSince(now, command_->arrived) > options_.command_timeout_s ||
      std::abs(SecondsFromUtime(now.utime - command_->utime)) > options_.command_timeout_s) {
    return {};
  }
  const RobotOptions& robot = options_.robot;
  return {std::clamp(command_->drive.linear_mps, -robot.max_speed_mps, robot.max_speed_mps),
          std::clamp(command_->drive.angular_radps, -robot.max_turn_radps, robot.max_turn_radps)};
}

OdometryKeeper::Report OdometryKeeper::Add(Instant now, const Pose2& odometry_from_base) {
  constexpr double kLongestS = 0.5;  // between two lines that a velocity can be told from
  Report report;
  report.odometry_from_robot = odometry_from_base * robot_.RobotFromBase().Inverse();
  const double elapsed_s = at_ ? SecondsSince(now, *at_) : 0.0;
  if (elapsed_s > 0.0 && elapsed_s < kLongestS) {
    const Pose2 motion = last_.Inverse() * odometry_from_base;
    report.forward_mps = motion.x / elapsed_s;
    report.turn_radps = motion.theta / elapsed_s;
  }
  // Lines that came in one piece have no time between them.
  if (!at_ || elapsed_s > 0.0) {
    at_ = now;
    last_ = odometry_from_base;
  }
  return report;
}

}  // namespace beckon
