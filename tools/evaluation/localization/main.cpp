// evaluate_localization SITE... [--json]: scores of all methods on recorded sites. Exit code 2 for
// bad input.
#include <CLI/CLI.hpp>
#include <exception>
#include <filesystem>
#include <iostream>
#include <vector>

#include "common/log.hpp"
#include "tools/evaluation/localization/evaluate.hpp"
#include "tools/evaluation/localization/report.hpp"

int main(int argc, char** argv) {
  CLI::App app("Scores localization methods on recorded site folders (see FORMATS.md)");
  std::vector<std::filesystem::path> folders;
  bool json = false;
  beckon::EvaluationOptions options;
  app.add_option("SITE", folders,
                 "site folder: site.toml, calibration.csv, readings.csv, truth.csv")
      ->required();
  app.add_flag("--json", json, "print JSON instead of tables");
  app.add_option("--resolution", options.resolution_m, "side of a grid cell, m")
      ->check(CLI::Range(0.05, 10.0));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  beckon::StartLogging("evaluate_localization", beckon::LogLevel::kWarning);
  std::vector<beckon::SiteEvaluation> sites;
  try {
    for (const std::filesystem::path& folder : folders) {
      sites.push_back(beckon::EvaluateSite(folder, options));
      if (!json) std::cout << beckon::Table(sites.back()) << std::endl;
    }
  } catch (const std::exception& error) {
    std::cerr << "evaluate_localization: " << error.what() << '\n';
    return 2;
  }
  if (json) {
    std::cout << beckon::Json(sites) << '\n';
  } else if (sites.size() > 1) {
    std::cout << beckon::Table(beckon::Merge(sites));
  }
  return 0;
}
