// Writes simulated places and drives as the folders that recordings come in: a site (floor plan,
// beacons, radio readings) and a sequence (camera frames with truth).
#pragma once

#include <filesystem>

#include "common/ground_camera.hpp"
#include "tools/simulation/radio.hpp"
#include "tools/simulation/renderer.hpp"
#include "tools/simulation/simulation.hpp"

namespace beckon::simulation {

// 640 x 480, 68 degrees wide, 0.55 m up, 26 degrees down: sees the floor from 0.42 m to the
// horizon.
GroundCamera DefaultCamera();

// FOLDER/site.toml, calibration.csv from a walk over all free floor, and readings.csv with
// truth.csv from other points. The furniture is not in it. Throws std::runtime_error where a file
// cannot be written.
void WriteSite(const std::filesystem::path& folder, const World& world, const RadioOptions& radio);

// The keys of a sequence.toml for this camera.
void WriteCamera(const std::filesystem::path& file, const std::string& name, double rate_hz,
                 const GroundCamera& camera);

struct SequenceOptions {
  int frames = 40;
  double rate_hz = 10.0;
  double speed_mps = 0.4;
  double max_range_m = 12.0;  // of the true scan: what is farther is written as inf
  int jpeg_quality = 88;
  RenderOptions render;
};

// A drive from the robot's start towards the caller, past the furniture and on to other places when
// it gets there, as FOLDER/sequence.toml, frames, truth, scans.csv and poses.csv.
void WriteSequence(const std::filesystem::path& folder, const World& world,
                   const GroundCamera& camera, const SequenceOptions& options);

}  // namespace beckon::simulation
