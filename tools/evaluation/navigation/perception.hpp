// What the robot of a mission sees: truth with a camera's faults, or pictures through the whole
// vision chain.
#pragma once

#include <cstdint>
#include <memory>

#include "common/robot_file.hpp"
#include "services/range_caster/ray_caster.hpp"
#include "tools/simulation/simulation.hpp"

namespace beckon {

class Perception {
 public:
  virtual ~Perception() = default;
  // The world as it is now, seen at `utime`.
  virtual VirtualScan See(const simulation::Simulation& world, Utime utime) = 0;
  virtual const RayCaster& caster() const = 0;
};

// True ranges with noise of a pixel's fraction, phantoms and blind spots.
std::unique_ptr<Perception> MakeScanPerception(const GroundCamera& camera, std::uint64_t seed);
// Rendered pictures, ground detector, ray caster.
std::unique_ptr<Perception> MakeCameraPerception(const GroundCamera& camera,
                                                 const RobotOptions& robot,
                                                 const simulation::World& world);

}  // namespace beckon
