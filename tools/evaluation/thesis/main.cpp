// evaluate_thesis walls|range: the experiments of the thesis's third chapter, repeated.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "tools/evaluation/thesis/report.hpp"

int main(int argc, char** argv) {
  CLI::App app("Repeats experiments of the thesis in simulation, beside the thesis's numbers.",
               "evaluate_thesis");
  beckon::ExperimentOptions options;
  int trials = 0;
  bool json = false;
  std::string experiment;
  app.add_option("EXPERIMENT", experiment,
                 "walls: section 3.5, three walls of one random texture; range: table 3-1, "
                 "distance of an object from 1.6 to 6.0 m")
      ->required()
      ->check(CLI::IsMember({"walls", "range"}));
  app.add_option("--trials", trials, "How many (100 of walls, 10 of range)")
      ->check(CLI::Range(1, 100000));
  app.add_option("--seed", options.seed, "Of the first trial")->capture_default_str();
  app.add_option("--pictures", options.pictures,
                 "Folder for pictures of what was found: the last view of each trial of walls, "
                 "each distance of range");
  app.add_option("--without", options.without, "Leave out a part of the detector")
      ->transform(CLI::CheckedTransformer(beckon::DetectorParts()))
      ->allow_extra_args(false);
  app.add_flag("--json", json, "Print JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  try {
    if (experiment == "walls") {
      options.trials = trials > 0 ? trials : 100;
      const auto scores = beckon::RunWallsExperiment(options);
      std::cout << (json ? beckon::WallsAsJson(scores) : beckon::WallsAsTable(scores));
    } else {
      options.trials = trials > 0 ? trials : 10;
      const auto table = beckon::RunRangeExperiment(options);
      std::cout << (json ? beckon::RangeAsJson(table, options.trials)
                         : beckon::RangeAsTable(table, options.trials));
    }
  } catch (const std::exception& error) {
    std::cerr << "evaluate_thesis: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
