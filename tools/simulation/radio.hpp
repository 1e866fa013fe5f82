// Signal strength in the flat: log-normal path loss with shadowing that is correlated in space,
// loss at walls, fading from packet to packet, and packets that get lost.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/simulation/random.hpp"
#include "tools/simulation/world.hpp"

namespace beckon::simulation {

struct RadioOptions {
  double power_at_1m_dbm = -42.0;
  double path_loss_exponent = 2.3;
  double wall_loss_db = 4.0;  // per inner wall crossed by the straight line
  double shadowing_sd_db = 3.0;
  double shadowing_length_m = 1.5;   // over which shadowing changes
  double beacon_offset_sd_db = 1.5;  // from beacon to beacon: antennas and mounting differ
  double rician_k = 4.0;             // power of the direct path over that of all others
  double packet_loss = 0.05;         // of packets strong enough to be received
  double sensitivity_dbm = -96.0;    // half of the packets of this power are lost
  double tag_period_s = 0.25;        // between packets of a tag
  double beacon_period_s = 0.25;     // between packets of a beacon
};

struct HeardTag {
  std::string tag;
  int rssi_dbm;
};

// What a beacon told the coordinator on the robot, and how strongly the coordinator heard it.
struct RadioPacket {
  std::string beacon;
  int rssi_dbm;
  std::vector<HeardTag>
      heard;  // since the beacon's last packet, whether or not that one got through
};

class Radio {
 public:
  Radio(const World& world, const RadioOptions& options);

  // Mean over the fading at a point of the plane, dBm. `height_m`: of the mobile radio.
  double MeanPower(std::size_t beacon, const Eigen::Vector2d& point, double height_m) const;

  // One packet between the beacon and a mobile radio there: its power as an XBee tells it (whole
  // dBm), nothing where it was lost.
  std::optional<int> Transmit(std::size_t beacon, const Eigen::Vector2d& point, double height_m,
                              Random& random) const;

  // All packets that reach the robot during one step of the world.
  std::vector<RadioPacket> Step(std::uint64_t step, double step_s, const Eigen::Vector2d& robot,
                                const Eigen::Vector2d& caller);

 private:
  double Shadowing(std::size_t beacon, const Eigen::Vector2d& point) const;

  struct Wave {
    Eigen::Vector2d number;  // rad/m
    double phase;
  };

  const World world_;
  const RadioOptions options_;
  std::vector<std::vector<Wave>> waves_;      // per beacon, whose sum is its shadowing
  std::vector<double> offset_db_;             // per beacon
  std::vector<std::vector<HeardTag>> heard_;  // per beacon, not reported yet
};

// Height of the robot's antenna, m.
inline constexpr double kRobotAntennaM = 0.4;

}  // namespace beckon::simulation
