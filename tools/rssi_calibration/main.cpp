// calibrate_rssi: what rssi_localizer will make of a place's calibration readings, to look at.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "common/csv.hpp"
#include "common/log.hpp"
#include "tools/rssi_calibration/radio_picture.hpp"
#include "tools/rssi_calibration/radio_report.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Fits the radio model of a place to its calibration readings, as rssi_localizer does at its\n"
      "start, and shows how well each beacon agrees with it.",
      "calibrate_rssi");
  std::string folder;
  std::string own_readings;
  std::string picture;
  bool as_json = false;
  app.add_option("SITE", folder, "Site folder: site.toml, calibration.csv")->required();
  app.add_option("--own-readings", own_readings,
                 "What the robot has recorded (own_readings of rssi_localizer), to use as well");
  app.add_option("--picture", picture, "Picture to write: RSSI over distance, with the fit");
  app.add_flag("--json", as_json, "Print JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  beckon::StartLogging("calibrate_rssi", beckon::LogLevel::kWarning);
  try {
    const beckon::RadioFit fit = beckon::FitRadio(folder, own_readings);
    std::cout << (as_json ? beckon::RadioFitAsJson(fit) : beckon::RadioFitAsTable(fit));
    if (!picture.empty() && !cv::imwrite(picture, beckon::DrawRadioFit(fit))) {
      throw beckon::FileError(picture, "cannot be written");
    }
  } catch (const std::exception& error) {
    std::cerr << "calibrate_rssi: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
