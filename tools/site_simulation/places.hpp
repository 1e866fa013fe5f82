// The three places of the thesis: EE1 (a room and a corridor), EE2 (a corridor), EE3 (a hallway).
// Of them it gives the floor area, the number of beacons and of measured points, and how much
// Min-Max errs (Tables 2-2 to 2-4); the layout is ours.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/site.hpp"

namespace beckon {

// How the radio behaves; no beacon differs from another but for its shadowing.
struct RadioModel {
  double rssi_at_1m_dbm = -45.0;
  double exponent = 2.2;
  double wall_db = 5.0;            // of each wall on the straight line
  double shadowing_sd_db = 6.0;    // Gaussian field of each beacon over the floor,
  double decorrelation_m = 2.0;    // its covariance falls by e over this distance
  double fading_sd_db = 3.0;       // of each reading, independent: multipath
  double sensitivity_dbm = -95.0;  // half of the readings of this power are lost,
  double sensitivity_sd_db = 2.0;  // with this spread (normal distribution)
  double quantum_db = 1.0;         // powers are reported in steps of this
};

struct Place {
  Site site;
  RadioModel radio;
  std::vector<Eigen::Vector2d> points;  // at which methods are judged, m
  std::vector<Eigen::Vector2d> walk;    // corners of the calibration walk, m
};

// "EE1", "EE2" or "EE3"; throws std::invalid_argument for another name.
Place ThesisPlace(const std::string& name);

}  // namespace beckon
