// The simulation in real time, behind the same devices and messages as a real robot.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "common/config.hpp"
#include "common/ground_camera.hpp"
#include "tools/simulation/base.hpp"
#include "tools/simulation/radio.hpp"
#include "tools/simulation/world.hpp"

namespace beckon::simulation {

struct LiveOptions {
  std::string lcm_url;
  GroundCamera camera;
  BaseOptions base;
  RadioOptions radio;
  WorldOptions world;
  int http_port = 8090;
  std::filesystem::path xbee_link = "/tmp/beckon-xbee";
  double camera_rate_hz = 10.0;
  int jpeg_quality = 85;
  double call_after_s = -1.0;        // negative: nobody calls
  std::filesystem::path truth_file;  // empty: none
};

// What the flat depends on: [robot] and [simulate_robot] walking_people.
WorldOptions ReadWorldOptions(ConfigFile& file);
// From [lcm], [camera], [robot] and [simulate_robot].
LiveOptions ReadLiveOptions(ConfigFile& file);

// Runs until `stop`. In: DRIVE. Out: ODOMETRY, CALL, camera over HTTP, XBee frames on a
// pseudo-terminal, and one line of JSON a second on stdout with the truth, a last one at the end.
void RunLive(const World& world, const LiveOptions& options, const std::atomic<bool>& stop);

}  // namespace beckon::simulation
