#include "services/beacon_reader/options.hpp"

#include <gmock/gmock.h>

#include "tests/support/support.hpp"

namespace beckon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Options : public ::testing::Test {
 protected:
  BeaconReaderOptions Read(const std::string& toml) {
    ConfigFile file(folder_.Write("robot.toml", toml));
    const BeaconReaderOptions options = ReadBeaconReaderOptions(file);
    file.Finish();
    return options;
  }
  std::string Refusal(const std::string& toml) {
    try {
      Read(toml);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  }
  testing::TempDir folder_;
};

TEST_F(Options, ReadsAnXbee) {
  const BeaconReaderOptions options = Read(R"(
[beacon_reader]
device = "/dev/ttyUSB0"
baud = 115200
api_mode = 1
robot_tag = "cart"
[[beacon_reader.beacons]]
address = "00a1"
id = "kitchen"
)");
  EXPECT_EQ(options.source, BeaconReaderOptions::Source::kXbee);
  EXPECT_EQ(options.baud, 115200);
  EXPECT_EQ(options.xbee.api_mode, XbeeApiMode::kPlain);
  EXPECT_EQ(options.xbee.robot_tag, "cart");
  EXPECT_EQ(options.xbee.beacon_of_address.at("00A1"), "kitchen");
}

TEST_F(Options, NamesWhatIsWrong) {
  const std::string start = "[beacon_reader]\ndevice = \"/dev/ttyUSB0\"\n";
  EXPECT_THAT(Refusal("[beacon_reader]\n"), HasSubstr("beacon_reader.device"));
  EXPECT_THAT(Refusal(start + "baud = 12345\n"),
              AllOf(HasSubstr("robot.toml:3"), HasSubstr("baud")));
  EXPECT_THAT(Refusal(start + "api_mode = 3\n"), HasSubstr("api_mode"));
  EXPECT_THAT(Refusal(start + "robot_tag = \"a b\"\n"), HasSubstr("robot_tag"));
  EXPECT_THAT(Refusal(start + "[[beacon_reader.beacons]]\naddress = \"12\"\nid = \"a\"\n"),
              HasSubstr("4 or 16 hexadecimal digits"));
  EXPECT_THAT(Refusal("[beacon_reader]\ndevice = \"tcp:host\"\n"), HasSubstr("tcp:HOST:PORT"));
  EXPECT_THAT(Refusal(start + "speed = 2.0\n"), HasSubstr("speed")) << "a key of another source";
}

TEST_F(Options, PlaybackNeedsARecording) {
  folder_.Write("site/site.toml",
                "name = \"s\"\n[area]\nmin = [0.0, 0.0]\nmax = [1.0, 1.0]\n"
                "[[beacons]]\nid = \"a\"\nposition = [0.0, 0.0, 1.0]\n");
  const std::string config = "[site]\nfolder = \"site\"\n[beacon_reader]\nsource = \"playback\"\n";
  folder_.Write("site/readings.csv", "utime,tag,beacon,rssi_dbm\n");
  EXPECT_THAT(Refusal(config), HasSubstr("no readings"));
  folder_.Write("site/readings.csv", "utime,tag,beacon,rssi_dbm\n1,t,a,-60\n");
  EXPECT_EQ(Read(config).recorded.size(), 1U);
  EXPECT_THAT(Refusal(config + "loop = true\nrestamp = false\n"), HasSubstr("restamp"));
}

}  // namespace
}  // namespace beckon
