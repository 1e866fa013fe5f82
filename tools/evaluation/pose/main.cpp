// evaluate_pose: does the robot find itself on the map? One drive a seed through a random furnished
// flat, faster than real time.
#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "common/log.hpp"
#include "tools/evaluation/pose/report.hpp"
#include "tools/evaluation/seeds.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Drives a robot that does not know where it is through random furnished flats, one a seed.",
      "evaluate_pose");
  beckon::PoseDriveOptions options;
  std::string motion = "odometry";
  bool as_json = false;
  beckon::Seeds seeds;
  beckon::AddSeedsOption(app, seeds);
  app.add_flag("--kidnap", options.is_carried, "carry the robot elsewhere after the first parts");
  app.add_option("--motion", motion, "odometry, or ground: the motion that the camera sees")
      ->check(CLI::IsMember({"odometry", "ground"}))
      ->capture_default_str();
  app.add_flag("--json", as_json, "print JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  options.has_odometry = motion == "odometry";
  beckon::StartLogging("evaluate_pose", beckon::LogLevel::kWarning);

  std::vector<beckon::PoseDrive> drives;
  if (!as_json) {
    std::cout << "  seed  judged   first right         error\n";
  }
  for (std::uint64_t seed = seeds.first; seed <= seeds.last; ++seed) {
    drives.push_back(beckon::RunPoseDrive(seed, options));
    if (!as_json) std::cout << beckon::DriveAsLine(drives.back(), options) << std::flush;
  }
  std::cout << (as_json ? beckon::DrivesAsJson(drives, options)
                        : beckon::DrivesAsTable(drives, options));
  return 0;
}
