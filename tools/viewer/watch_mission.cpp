// watch_mission: follows the robot on its errand: a line a second, the scene as a window or a
// picture, and a summary when the navigator has arrived or given up.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <opencv2/highgui.hpp>
#include <opencv2/imgcodecs.hpp>

#include "beckon/velocity_command_t.hpp"
#include "bot_core/pose_t.hpp"
#include "common/channels.hpp"
#include "common/config.hpp"
#include "common/log.hpp"
#include "common/message_bus.hpp"
#include "common/pose_message.hpp"
#include "common/robot_file.hpp"
#include "tools/viewer/mission_log.hpp"

namespace {

using beckon::Instant;
using beckon::MissionLog;
using beckon::navigator_status_t;
using beckon::Scene;

constexpr int kExitNotArrived = 1;
constexpr int kExitBadConfig = 2;
constexpr std::size_t kFramesKept = 8;
constexpr double kArrivedWithinM = 2.0;

struct Arguments {
  std::filesystem::path config;
  std::filesystem::path truth;
  std::filesystem::path picture;
  std::string lcm_url;
  bool window = false;
  double timeout_s = 300.0;
};

void Subscribe(beckon::MessageBus& bus, const beckon::Clock& clock, Scene& scene, MissionLog& log) {
  namespace channels = beckon::channels;
  bus.Subscribe<bot_core::image_t>(channels::kCamera, [&](const bot_core::image_t& frame) {
    scene.frames.push_back(frame);
    log.answers().OnFrame(frame.utime);
    if (scene.frames.size() > kFramesKept) scene.frames.pop_front();
  });
  bus.Subscribe<beckon::ground_t>(channels::kGround,
                                  [&](const beckon::ground_t& ground) { scene.ground = ground; });
  bus.Subscribe<bot_core::planar_lidar_t>(channels::kScan,
                                          [&](const bot_core::planar_lidar_t& scan) {
                                            scene.scan = scan;
                                            log.OnScan();
                                            log.answers().OnScan(scan.utime, clock.Now().utime);
                                          });
  bus.Subscribe<beckon::velocity_command_t>(channels::kDrive,
                                            [&](const beckon::velocity_command_t& drive) {
                                              log.answers().OnDrive(drive.utime, clock.Now().utime);
                                            });
  bus.Subscribe<beckon::occupancy_grid_t>(
      channels::kGrid, [&](const beckon::occupancy_grid_t& grid) { scene.grid = grid; });
  bus.Subscribe<beckon::probability_map_t>(channels::kLocationMap,
                                           [&](const beckon::probability_map_t& map) {
                                             if (scene.status && scene.status->tag == map.tag)
                                               scene.possible_area = map;
                                           });
  bus.Subscribe<beckon::location_t>(
      channels::kLocation, [&](const beckon::location_t& location) { log.OnLocation(location); });
  bus.Subscribe<navigator_status_t>(
      channels::kNavigator, [&](const navigator_status_t& status) { scene.status = status; });
  bus.Subscribe<bot_core::pose_t>(channels::kRobotPose, [&](const bot_core::pose_t& pose) {
    scene.map_from_robot = beckon::PoseFromMessage(pose);
    log.OnPose(*scene.map_from_robot);
  });
  bus.Subscribe<beckon::service_health_t>(
      channels::kHealth,
      [&](const beckon::service_health_t& health) { log.OnHealth(health, clock.Now()); });
}

// Prints the summary; true when the robot stands beside the caller and touched nothing.
bool Summarize(const Scene& scene, MissionLog& log, const std::optional<beckon::Truth>& truth,
               Instant now) {
  const bool says_arrived = scene.status && scene.status->state == navigator_status_t::ARRIVED;
  bool well = says_arrived;
  std::printf("\n%-28s %s\n", "navigator", says_arrived ? "arrived" : "did not arrive");
  std::printf("%-28s %.0f s\n", "time", log.elapsed_s(now));
  if (truth) {
    well = well && truth->collisions == 0 && truth->distance_to_caller_m <= kArrivedWithinM;
    std::printf("%-28s %.1f m\n", "path length", truth->path_length_m);
    std::printf("%-28s %.2f m\n", "distance to the true caller", truth->distance_to_caller_m);
    std::printf("%-28s %.2f m\n", "closest to an obstacle", truth->closest_approach_m);
    std::printf("%-28s %d\n", "collisions", truth->collisions);
  } else {
    std::printf("%-28s %.1f m\n", "path length", log.path_length_m());
  }
  std::printf("%-28s %.1f\n", "frames per second", log.scans_per_second(now));
  const beckon::AnswerTimes::Summary answers = log.answers().Summarize();
  std::printf("%-28s median %.0f ms, 95 %% within %.0f ms\n", "from frame to command",
              1e3 * answers.median_s, 1e3 * answers.p95_s);
  std::printf("%-28s %d of %d\n", "frames never answered", answers.unanswered,
              answers.answered + answers.unanswered);
  return well;
}

bool IsOver(const Scene& scene) {
  return scene.status && (scene.status->state == navigator_status_t::ARRIVED ||
                          scene.status->state == navigator_status_t::GAVE_UP);
}

int Watch(const Arguments& arguments) {
  beckon::ConfigFile file(arguments.config);
  std::filesystem::path site_folder;
  file.Table("site").RequiredPath("folder", site_folder);
  const beckon::Site site = beckon::Site::Load(site_folder);
  const beckon::RobotOptions robot = beckon::ReadRobotOptions(file);
  const std::string url = arguments.lcm_url.empty() ? beckon::ReadLcmUrl(file) : arguments.lcm_url;

  const beckon::SystemClock clock;
  beckon::MessageBus bus(url);
  Scene scene;
  MissionLog log;
  Subscribe(bus, clock, scene, log);

  const Instant started = clock.Now();
  std::chrono::microseconds next_line = started.steady;
  std::optional<beckon::Truth> truth;
  while (true) {
    bus.Dispatch(std::chrono::milliseconds(50));
    const Instant now = clock.Now();
    if (!arguments.truth.empty()) {
      truth = beckon::ReadTruth(arguments.truth);
      if (truth) scene.true_caller = truth->caller;
    }
    if (now.steady >= next_line) {
      next_line += std::chrono::seconds(1);
      std::cout << log.Line(scene, now) << std::endl;
      if (!arguments.picture.empty())
        cv::imwrite(arguments.picture.string(), DrawScene(site, robot, scene));
    }
    if (arguments.window) {
      cv::imshow("Beckon", DrawScene(site, robot, scene));
      cv::waitKey(1);
    }
    const bool timed_out =
        std::chrono::duration<double>(now.steady - started.steady).count() > arguments.timeout_s;
    if (IsOver(scene) || timed_out) {
      if (timed_out) std::cout << "\nnot there after " << arguments.timeout_s << " s\n";
      return Summarize(scene, log, truth, now) ? 0 : kExitNotArrived;
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Follows the robot on its errand until it has arrived or given up. Exit 0 when it arrived, "
      "and, "
      "where the truth is known, within 2 m of the caller without touching anything.",
      "watch_mission");
  Arguments arguments;
  app.add_option("--config", arguments.config, "Configuration of the robot")->required();
  app.add_option("--truth", arguments.truth, "File that simulate_robot --truth writes");
  app.add_option("--picture", arguments.picture,
                 "Write the scene here once a second (.png or .jpg)");
  app.add_flag("--window", arguments.window, "Show the scene in a window");
  app.add_option("--timeout", arguments.timeout_s, "Give up watching after so many seconds")
      ->capture_default_str();
  app.add_option("--lcm-url", arguments.lcm_url, "LCM network");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitBadConfig;
  }
  beckon::StartLogging("watch_mission", beckon::LogLevel::kInfo);
  try {
    return Watch(arguments);
  } catch (const std::exception& error) {
    beckon::LogError(error.what());
    return kExitBadConfig;
  }
}
