// Random numbers as a pure function of (seed, stream, index): a run can be repeated whatever order
// the parts of the simulation draw in, and however many draws one of them makes.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace beckon::simulation {

// One independent stream per purpose.
enum class Stream : std::uint64_t {
  kLayout = 1,
  kFurniture,
  kPlaces,
  kPeople,
  kLook,
  kTexture,
  kCameraNoise,
  kShadowing,
  kFading,
  kPacketLoss,
  kCalibrationWalk,
  kOdometry,
};

// SplitMix64 finalizer (Steele, Lea, Flood, "Fast splittable pseudorandom number generators",
// 2014).
constexpr std::uint64_t Scramble(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15ULL;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ULL;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebULL;
  return value ^ (value >> 31);
}

class Random {
 public:
  Random(std::uint64_t seed, Stream stream, std::uint64_t index = 0)
      : state_(Scramble(Scramble(Scramble(seed) + static_cast<std::uint64_t>(stream)) + index)) {}

  std::uint64_t Bits() { return state_ = Scramble(state_); }
  // In [0, 1).
  double Uniform() { return static_cast<double>(Bits() >> 11) * 0x1.0p-53; }
  double Uniform(double min, double max) { return min + (max - min) * Uniform(); }
  // A point of a rectangle. (Arguments of one call are drawn in no particular order, so that two
  // draws in one expression would be another world with another compiler.)
  Eigen::Vector2d UniformIn(const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
    const double y = Uniform(min.y(), max.y());
    const double x = Uniform(min.x(), max.x());
    return {x, y};
  }
  // In [min, max], both included.
  int Integer(int min, int max) {
    return min + static_cast<int>(Bits() % static_cast<std::uint64_t>(max - min + 1));
  }
  bool Chance(double probability) { return Uniform() < probability; }
  // Standard normal, by Box and Muller.
  double Normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace beckon::simulation
