// evaluate_navigation: missions in random furnished flats, faster than real time.
#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <string>

#include "common/log.hpp"
#include "tools/evaluation/navigation/report.hpp"
#include "tools/evaluation/seeds.hpp"

int main(int argc, char** argv) {
  CLI::App app("Missions in random furnished flats: one a seed.", "evaluate_navigation");
  const std::map<std::string, beckon::Scenario> scenarios = {
      {"flat", beckon::Scenario::kFlat},
      {"demo", beckon::Scenario::kDemo},
      {"door", beckon::Scenario::kDoor},
      {"step-in", beckon::Scenario::kStepIn},
      {"step-in-standing", beckon::Scenario::kStepInStanding}};
  std::string scenario = "flat";
  std::string perception = "scan";
  std::string pose = "filter";
  std::string pictures;
  bool as_json = false;
  app.add_option("--scenario", scenario,
                 "flat: random furnished flats; demo: those of tools/demo; door: through 0.8 m; "
                 "step-in: somebody steps in; step-in-standing: the same, while the robot stands")
      ->check(CLI::IsMember(scenarios));
  app.add_option("--perception", perception,
                 "scan: true ranges with a camera's faults; camera: pictures")
      ->check(CLI::IsMember({"scan", "camera"}));
  app.add_option("--pose", pose,
                 "filter: rssi_localizer's, from a known start; truth: the true one")
      ->check(CLI::IsMember({"filter", "truth"}));
  double odometry_error = 1.0;
  app.add_option("--odometry-error", odometry_error,
                 "times the usual errors of scale and drift: 1 % of way and angle, sd")
      ->check(CLI::Range(0.0, 20.0));
  beckon::Seeds seeds;
  beckon::AddSeedsOption(app, seeds);
  app.add_option("--pictures", pictures, "folder for a picture of each mission that failed");
  app.add_flag("--json", as_json, "print JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  beckon::MissionOptions options = beckon::DefaultMissionOptions(scenarios.at(scenario));
  options.use_camera = perception == "camera";
  options.use_true_pose = pose == "truth";
  options.odometry_error = odometry_error;
  beckon::StartLogging("evaluate_navigation", beckon::LogLevel::kWarning);

  std::vector<beckon::Mission> missions;
  if (!as_json) {
    std::cout << "  seed  outcome          time      path  /short  closest  to caller  reason\n";
  }
  for (std::uint64_t seed = seeds.first; seed <= seeds.last; ++seed) {
    missions.push_back(beckon::RunMission(seed, options));
    const beckon::Mission& mission = missions.back();
    if (!as_json) std::cout << beckon::MissionAsLine(mission) << std::flush;
    if (!pictures.empty() && mission.outcome != "arrived" && mission.outcome != "unreachable") {
      beckon::DrawMission(mission, pictures + "/mission_" + std::to_string(seed) + ".png");
    }
  }
  std::cout << (as_json ? beckon::MissionsAsJson(missions) : beckon::MissionsAsTable(missions));
  return 0;
}
