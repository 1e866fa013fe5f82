// calibrate_ground: what a camera's pixels are on the floor, from pictures of boards and marks.
#include <CLI/CLI.hpp>
#include <exception>
#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "common/csv.hpp"
#include "tools/calibration/report.hpp"

namespace {

void Write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  stream.close();
  if (!stream) throw beckon::FileError(file, "cannot be written");
}

void WritePicture(const std::filesystem::path& file, const cv::Mat& picture) {
  if (!cv::imwrite(file.string(), picture)) throw beckon::FileError(file, "cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Calibrates a camera that looks at the floor, and writes the file that the services read.\n"
      "How to, step by step: tools/calibration/README.md",
      "calibrate_ground");
  beckon::SessionOptions options;
  std::string output, grid, board;
  double height_m = 0.0;
  app.add_option("INPUT", options.input,
                 "Session (.toml) of boards and marks, or marks alone (.csv: u,v,x_m,y_m)")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--output", output, "File to write, for [camera] calibration");
  app.add_option("--grid", grid, "Picture to write: the floor's grid over what the camera sees");
  app.add_option("--picture", options.picture, "Picture of the floor; needed for a .csv");
  app.add_option("--lens", options.lens, "Take the lens over from this earlier output");
  app.add_option("--height", height_m, "Measured height of the lens above the floor, m")
      ->check(CLI::PositiveNumber);
  app.add_option("--draw-board", board, "Only draw the session's board, to print it");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (height_m > 0.0) options.camera_height_m = height_m;

  try {
    if (!board.empty()) {
      beckon::ConfigFile file(options.input);
      WritePicture(board, beckon::DrawBoard(beckon::ReadBoard(file.Table("board")), 120));
      return 0;
    }
    const beckon::Session session = beckon::ReadSession(options);
    const beckon::Mount mount = beckon::SolveMount(session.mount);
    std::cout << beckon::DescribeMount(session, mount);
    if (!grid.empty()) WritePicture(grid, beckon::DrawGrid(session, mount));
    if (!output.empty()) {
      Write(output, "# Written by calibrate_ground from " + options.input.filename().string() +
                        ".\n" + mount.camera.Toml());
      beckon::GroundCamera::Load(output);  // as the services will
    }
  } catch (const std::exception& error) {
    std::cerr << "calibrate_ground: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
