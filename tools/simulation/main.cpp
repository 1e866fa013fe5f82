// simulate_robot: a robot, its camera, radio and base in a random furnished flat.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>

#include "common/log.hpp"
#include "tools/simulation/folders.hpp"
#include "tools/simulation/live_robot.hpp"

namespace {

std::atomic<bool> stop_requested = false;
extern "C" void RequestStop(int) { stop_requested = true; }

// The flat depends on the robot, which has to fit through it.
beckon::simulation::WorldOptions WorldOptionsFrom(const std::string& config) {
  if (config.empty()) return {};
  beckon::ConfigFile file(config);
  return beckon::simulation::ReadWorldOptions(file);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace beckon;  // NOLINT(google-build-using-namespace): a program of one page
  CLI::App app("A simulated robot in a random furnished flat. The same seed is the same flat.",
               "simulate_robot");
  std::uint64_t seed = 1;
  std::string config, prepare, sequence, lcm_url, truth;
  double call_after_s = -1.0;
  simulation::SequenceOptions drive;
  app.add_option("--seed", seed, "Number of the flat")->capture_default_str();
  app.add_option("--config", config,
                 "Robot file; with neither --prepare nor --sequence: run in real time as it says");
  auto* prepare_option =
      app.add_option("--prepare", prepare, "Write DIR/site and DIR/camera.toml, and end");
  app.add_option("--sequence", sequence,
                 "Write camera frames of a scripted drive with truth to DIR, and end")
      ->excludes(prepare_option);
  app.add_option("--frames", drive.frames, "Frames of the sequence")->capture_default_str();
  app.add_option("--rate", drive.rate_hz, "Frames a second of the sequence")->capture_default_str();
  app.add_option("--lcm-url", lcm_url, "LCM network, instead of the configuration's");
  app.add_option("--call-after", call_after_s,
                 "The caller presses the button after so many seconds");
  app.add_option("--truth", truth, "File for the lines that go to stdout");
  CLI11_PARSE(app, argc, argv);

  StartLogging("simulate_robot", LogLevel::kInfo);
  std::signal(SIGTERM, RequestStop);
  std::signal(SIGINT, RequestStop);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    if (!prepare.empty()) {
      const simulation::World world = simulation::MakeWorld(seed, WorldOptionsFrom(config));
      simulation::WriteSite(prepare + "/site", world, {});
      simulation::WriteCamera(prepare + "/camera.toml", "simulated", 10.0,
                              simulation::DefaultCamera());
    } else if (!sequence.empty()) {
      const simulation::World world = simulation::MakeWorld(seed, WorldOptionsFrom(config));
      simulation::WriteSequence(sequence, world, simulation::DefaultCamera(), drive);
    } else {
      ConfigFile file(config);
      file.IgnoreOtherPrograms();
      simulation::LiveOptions options = simulation::ReadLiveOptions(file);
      file.Finish();
      if (!lcm_url.empty()) options.lcm_url = lcm_url;
      options.call_after_s = call_after_s;
      options.truth_file = truth;
      simulation::RunLive(simulation::MakeWorld(seed, options.world), options, stop_requested);
    }
  } catch (const ConfigError& error) {
    LogError(error.what());
    return 2;
  } catch (const std::exception& error) {
    LogError(error.what());
    return 1;
  }
  return 0;
}
