// The scan that perfect vision would give, with a camera's field of view and, where wanted, its
// faults.
#pragma once

#include <functional>
#include <random>
#include <vector>

#include "services/range_caster/ray_caster.hpp"

namespace beckon {

struct ScanFaults {
  double range_noise = 0.0;   // relative, sd
  double pixel_noise = 0.0;   // sd of the foot's row in the picture, pixels
  double phantom_rate = 0.0;  // of scans in which a block of rays hits something that is not there
  double blind_rate = 0.0;    // of scans in which a block of rays is undetermined
};

class TruthScanner {
 public:
  TruthScanner(const GroundCamera& camera, const ScanFaults& faults, std::uint64_t seed);

  // `range`: true distance from the robot frame's origin to the first thing that stands, m, along a
  // bearing in the robot frame; infinity where there is none.
  VirtualScan Look(const std::function<double(double bearing_rad)>& range);

  const RayCaster& caster() const { return caster_; }

 private:
  struct Block {
    std::size_t begin, end;  // rays
    bool Contains(std::size_t ray) const { return ray >= begin && ray < end; }
  };
  Block DrawBlock(double rate);

  RayCaster caster_;
  ScanFaults faults_;
  VirtualScan open_floor_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

}  // namespace beckon
