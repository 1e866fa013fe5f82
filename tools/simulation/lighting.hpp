// Light in the flat: one lamp below the ceiling of each room, light from all round, and soft
// shadows.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "tools/simulation/random.hpp"
#include "tools/simulation/world.hpp"

namespace beckon::simulation {

class Lighting {
 public:
  Lighting(const World& world, Random& random);
  // The same light on everything, and no shadows.
  static Lighting Even() { return {}; }

  // Light on an upright surface at a point of it, relative to the floor below the lamp. `normal`:
  // unit vector in the plane, pointing away from the surface. The room is that of a point just off
  // the surface.
  float OnUpright(const Eigen::Vector2d& point, const Eigen::Vector2d& normal) const;

  // Light on the floor with the shadows of all that stands; CV_32FC1, kCellM a cell, from
  // world.min.
  static constexpr double kCellM = 0.02;
  cv::Mat OnFloor(const World& world) const;

 private:
  Lighting() = default;

  struct Lamp {
    Eigen::Vector3d position;  // m, map frame
    float strength;            // of direct light below it
    float ambient;
  };
  std::size_t NearestRoom(const Eigen::Vector2d& point) const;
  float OnFloorUnshadowed(const Eigen::Vector2d& point) const;
  void DarkenCastShadows(const World& world, cv::Mat& light) const;

  std::vector<Room> rooms_;
  std::vector<Lamp> lamps_;  // one a room; none in even light
};

// How much darker the floor is at this distance from the foot of something, where light from all
// round is blocked: a factor.
float ContactShade(float distance_m);

}  // namespace beckon::simulation
