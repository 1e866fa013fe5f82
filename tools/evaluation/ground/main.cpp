// evaluate_ground SEQUENCE...: how well the ground detector does on recorded sequences.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "tools/evaluation/ground/evaluate.hpp"

int main(int argc, char** argv) {
  CLI::App app("Runs the ground detector over sequence folders and compares with their truth.",
               "evaluate_ground");
  std::vector<std::string> sequences;
  bool json = false;
  beckon::GroundEvaluationOptions options;
  app.add_option("SEQUENCE", sequences, "Sequence folders")->required();
  app.add_flag("--json", json, "Print the scores as JSON");
  app.add_option("--overlay", options.overlay, "Write a picture of each frame below this folder");
  app.add_option("--max-range", options.max_range_m, "True ranges beyond are not judged, m")
      ->check(CLI::PositiveNumber);
  app.add_option("--max-speed", options.max_speed_heights,
                 "What carries the camera is not faster, in camera heights a second")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--without", options.without,
                 "Leave out a part of the detector, to see what it does")
      ->transform(CLI::CheckedTransformer(beckon::DetectorParts()))
      ->allow_extra_args(false);
  CLI11_PARSE(app, argc, argv);

  try {
    std::vector<beckon::GroundScores> scores;
    for (const std::string& sequence : sequences) {
      scores.push_back(beckon::EvaluateSequence(sequence, options));
    }
    std::cout << (json ? beckon::ScoresAsJson(scores) : beckon::ScoresAsTable(scores));
  } catch (const std::exception& error) {
    std::cerr << "evaluate_ground: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
