// simulate_site EE1|EE2|EE3 DIR [--seed N]: writes one of the thesis's places as a site folder.
#include <CLI/CLI.hpp>
#include <exception>
#include <filesystem>
#include <iostream>

#include "tools/site_simulation/simulated_site.hpp"

int main(int argc, char** argv) {
  CLI::App app("Writes one of the thesis's places, with simulated readings, as a site folder");
  std::string name;
  std::filesystem::path folder;
  unsigned seed = 1;
  app.add_option("PLACE", name, "EE1 (room and corridor), EE2 (corridor) or EE3 (hallway)")
      ->required();
  app.add_option("DIR", folder, "folder to write to")->required();
  app.add_option("--seed", seed, "of the shadowing and the fading");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    beckon::WriteSimulatedSite(beckon::ThesisPlace(name), seed, folder);
  } catch (const std::exception& error) {
    std::cerr << "simulate_site: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
