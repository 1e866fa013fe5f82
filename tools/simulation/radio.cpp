#include "tools/simulation/radio.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace beckon::simulation {
namespace {

constexpr int kWaves = 48;
constexpr double kSensitivitySlopeDb =
    1.5;  // from half of the packets to a quarter or three quarters

// Whether something that happens every `period` with this offset happens during the step.
bool IsDue(std::uint64_t step, double step_s, double period_s, double offset_s) {
  const double end = static_cast<double>(step + 1) * step_s - offset_s;
  return std::floor(end / period_s) > std::floor((end - step_s) / period_s);
}

}  // namespace

Radio::Radio(const World& world, const RadioOptions& options)
    : world_(world), options_(options), heard_(world.beacons.size()) {
  for (std::size_t i = 0; i < world_.beacons.size(); ++i) {
    Random random(world_.seed, Stream::kShadowing, i);
    offset_db_.push_back(options_.beacon_offset_sd_db * random.Normal());
    std::vector<Wave>& waves = waves_.emplace_back();
    // Random Fourier features (Rahimi and Recht, 2007) of a Gaussian correlation exp(-d^2 / 2 L^2).
    for (int k = 0; k < kWaves; ++k) {
      const double number_y = random.Normal();
      const Eigen::Vector2d number(random.Normal(), number_y);
      waves.push_back(
          {number / options_.shadowing_length_m, random.Uniform(0.0, 2.0 * std::numbers::pi)});
    }
  }
}

double Radio::Shadowing(std::size_t beacon, const Eigen::Vector2d& point) const {
  double sum = 0.0;
  for (const Wave& wave : waves_[beacon]) sum += std::cos(wave.number.dot(point) + wave.phase);
  return options_.shadowing_sd_db * std::sqrt(2.0 / kWaves) * sum;
}

double Radio::MeanPower(std::size_t beacon, const Eigen::Vector2d& point, double height_m) const {
  const Eigen::Vector3d from = world_.beacons[beacon].position;
  const double distance_m =
      std::max(0.3, (from - Eigen::Vector3d(point.x(), point.y(), height_m)).norm());
  int walls = 0;
  for (const Wall& wall : world_.inner_walls) {
    walls += SegmentsMeet(from.head<2>(), point, wall.from, wall.to);
  }
  return options_.power_at_1m_dbm + offset_db_[beacon] -
         10.0 * options_.path_loss_exponent * std::log10(distance_m) -
         options_.wall_loss_db * walls + Shadowing(beacon, point);
}

std::optional<int> Radio::Transmit(std::size_t beacon, const Eigen::Vector2d& point,
                                   double height_m, Random& random) const {
  // Rician fading: a direct path and many weak ones.
  const double direct = std::sqrt(options_.rician_k / (options_.rician_k + 1.0));
  const double scatter = std::sqrt(0.5 / (options_.rician_k + 1.0));
  const double in_phase = direct + scatter * random.Normal();
  const double quadrature = scatter * random.Normal();
  const double fading_db = 10.0 * std::log10(in_phase * in_phase + quadrature * quadrature + 1e-6);
  const double power_dbm = MeanPower(beacon, point, height_m) + fading_db;
  const double weak_loss =
      1.0 / (1.0 + std::exp((power_dbm - options_.sensitivity_dbm) / kSensitivitySlopeDb));
  const double chance = (1.0 - options_.packet_loss) * (1.0 - weak_loss);
  if (!random.Chance(chance)) return std::nullopt;
  return static_cast<int>(std::lround(std::min(power_dbm, -20.0)));
}

std::vector<RadioPacket> Radio::Step(std::uint64_t step, double step_s,
                                     const Eigen::Vector2d& robot, const Eigen::Vector2d& caller) {
  if (IsDue(step, step_s, options_.tag_period_s, 0.0)) {
    for (std::size_t i = 0; i < heard_.size(); ++i) {
      Random random(world_.seed, Stream::kFading, (step * 1000 + i) * 2);
      if (const auto rssi = Transmit(i, caller, kTagHeightM, random)) {
        heard_[i].push_back({kCallerTag, *rssi});
      }
    }
  }
  std::vector<RadioPacket> packets;
  for (std::size_t i = 0; i < heard_.size(); ++i) {
    // The beacons take turns.
    const double offset_s = options_.beacon_period_s * (static_cast<double>(i) + 0.5) /
                            static_cast<double>(heard_.size());
    if (!IsDue(step, step_s, options_.beacon_period_s, offset_s)) continue;
    Random random(world_.seed, Stream::kFading, (step * 1000 + i) * 2 + 1);
    if (const auto rssi = Transmit(i, robot, kRobotAntennaM, random)) {
      packets.push_back({world_.beacons[i].id, *rssi, heard_[i]});
    }
    heard_[i].clear();
  }
  return packets;
}

}  // namespace beckon::simulation
