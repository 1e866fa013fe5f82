// The robot files that people copy say the truth.
#include <gmock/gmock.h>

#include <fstream>
#include <set>
#include <sstream>
#include <vector>

#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

const char* const kServices[] = {"beacon_reader",   "rssi_localizer", "camera_grabber",
                                 "ground_detector", "range_caster",   "navigator"};

std::string ReadText(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

class RobotFilesTest : public ::testing::Test {
 protected:
  RobotFilesTest() {
    const auto prepared = testing::RunToEnd(
        "simulate_robot", {"--config", testing::SourceDir() / "deploy/robots/simulated.toml",
                           "--prepare", directory_.path(), "--seed", "1"});
    EXPECT_EQ(prepared.exit_code, 0) << prepared.output;
  }
  // The lines "key = value" of --print-config.
  std::set<std::string> Effective(const std::string& service, const std::string& config_text) {
    const auto config = directory_.Write("robot.toml", config_text);
    const auto finished = testing::RunToEnd(service, {"--config", config, "--print-config"});
    EXPECT_EQ(finished.exit_code, 0) << finished.output;
    std::set<std::string> lines;
    std::istringstream stream(finished.output);
    for (std::string line; std::getline(stream, line);) {
      if (line.find(" = ") != std::string::npos) lines.insert(line);
    }
    return lines;
  }
  static std::string RobotFile(const std::string& name) {
    return ReadText(testing::SourceDir() / "deploy/robots" / name);
  }
  testing::TempDir directory_;
};

TEST_F(RobotFilesTest, TheSimulatedRobotIsAccepted) {
  for (const char* service : kServices)
    EXPECT_FALSE(Effective(service, RobotFile("simulated.toml")).empty());
}

TEST_F(RobotFilesTest, TheExampleHasEveryKeyWithItsDefault) {
  const std::string example = RobotFile("example.toml");
  const std::string least =
      "[site]\nfolder = 'site'\n[camera]\ncalibration = 'camera.toml'\n"
      "[beacon_reader]\ndevice = '/dev/serial/by-id/usb-xbee'\n"
      "[base_adapter]\ndevice = '/dev/serial/by-id/usb-base'\n";
  std::vector<std::string> programs(std::begin(kServices), std::end(kServices));
  programs.emplace_back("base_adapter");
  for (const std::string& service : programs) {
    const auto defaults = Effective(service, least);
    EXPECT_EQ(Effective(service, example), defaults) << service;
    for (const std::string& line : defaults) {
      // A key whose default is "none" stands there as a comment.
      const std::string key = line.substr(0, line.find(" = ")) + " = ";
      EXPECT_TRUE(example.find("\n" + key) != std::string::npos ||
                  example.find("\n# " + key) != std::string::npos)
          << service << ": " << key;
    }
  }
}

}  // namespace
}  // namespace beckon
