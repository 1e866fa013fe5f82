// Radio readings of a made-up place, as a site folder with known truth and known parameters.
//
// A reading is path loss (log of the distance in space, walls on the straight line) plus shadowing
// plus fading, rounded, and lost near the receiver's sensitivity. Shadowing is a Gaussian field of
// each beacon over the floor, so that it stays while a tag stays and is alike nearby (Gudmundson,
// "Correlation model for shadow fading in mobile radio systems", Electronics Letters 27, 1991);
// fading is drawn anew for each reading.
#pragma once

#include <filesystem>
#include <random>

#include "tools/site_simulation/places.hpp"

namespace beckon {

// A Gaussian field over the plane with standard deviation 1 and correlation exp(-distance /
// length), as a sum of waves whose directions and lengths follow its spectrum (Rahimi and Recht,
// "Random features for large-scale kernel machines", NIPS 2007).
class ShadowingField {
 public:
  ShadowingField(double length_m, std::mt19937_64& random);
  double At(const Eigen::Vector2d& position) const;

 private:
  struct Wave {
    Eigen::Vector2d number;  // rad/m
    double phase;
  };
  std::vector<Wave> waves_;
};

// Writes site.toml, calibration.csv (a walk with the tag, and what the beacons hear of each other),
// readings.csv, truth.csv and generated.toml (the radio's parameters, for the oracle). Throws
// std::runtime_error where the folder cannot be written.
void WriteSimulatedSite(const Place& place, unsigned seed, const std::filesystem::path& folder);

}  // namespace beckon
