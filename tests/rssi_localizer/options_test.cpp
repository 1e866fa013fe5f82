#include "services/rssi_localizer/options.hpp"

#include <gmock/gmock.h>

#include "common/csv.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr char kSite[] =
    "name = \"s\"\n[area]\nmin = [0.0, 0.0]\nmax = [4.0, 4.0]\n"
    "[[beacons]]\nid = \"a\"\nposition = [0.0, 0.0, 1.0]\n";

class Options : public ::testing::Test {
 protected:
  Options() { folder_.Write("site/site.toml", kSite); }
  RssiLocalizerOptions Read(const std::string& rest) {
    ConfigFile file(
        folder_.Write("robot.toml", "[site]\nfolder = \"site\"\n[rssi_localizer]\n" + rest));
    const RssiLocalizerOptions options = ReadRssiLocalizerOptions(file);
    file.Finish();
    return options;
  }
  std::string Refusal(const std::string& rest) {
    try {
      Read(rest);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  }
  testing::TempDir folder_;
};

TEST_F(Options, HaveDefaultsForAllButTheSite) {
  const RssiLocalizerOptions options = Read("");
  EXPECT_EQ(options.site.name, "s");
  EXPECT_TRUE(options.calibration.empty());
  EXPECT_TRUE(options.localizer.tracking);
  EXPECT_FALSE(options.robot.map_from_odometry);
  EXPECT_EQ(options.robot.robot_tag, "robot");
}

TEST_F(Options, TakeTheStartOfOdometry) {
  const RssiLocalizerOptions options = Read("map_from_odometry = [1.0, 2.0, 0.5]\n");
  EXPECT_EQ(options.robot.map_from_odometry->x, 1.0);
  EXPECT_EQ(options.robot.map_from_odometry->y, 2.0);
  EXPECT_EQ(options.robot.map_from_odometry->theta, 0.5);
}

TEST_F(Options, WhatTheRobotRecordedIsCalibrationToo) {
  EXPECT_TRUE(Read("own_readings = \"own.csv\"\n").calibration.empty()) << "not begun yet";
  folder_.Write("own.csv", "utime,tag,beacon,rssi_dbm,x_m,y_m\n1,robot,a,-60,1,1\n");
  const RssiLocalizerOptions options = Read("own_readings = \"own.csv\"\n");
  ASSERT_EQ(options.calibration.size(), 1U);
  EXPECT_TRUE(options.calibration[0].by_robot);
  EXPECT_EQ(options.known_own_readings, 1);
  EXPECT_THAT(Refusal("own_readings = \"nowhere/own.csv\"\n"),
              AllOf(HasSubstr("rssi_localizer.own_readings"), HasSubstr("nowhere")));
}

TEST_F(Options, ErrorsNameFileLineAndKey) {
  EXPECT_THAT(Refusal("resolution_m = -1.0\n"),
              AllOf(HasSubstr("robot.toml:4"), HasSubstr("rssi_localizer.resolution_m")));
  EXPECT_THAT(Refusal("measurement_model = \"magic\"\n"), HasSubstr("measurement_model"));
  EXPECT_THAT(Refusal("measurement_model = \"map_2d\"\n"), HasSubstr("needs calibration readings"));
  EXPECT_THAT(Refusal("map_from_odometry = [1.0]\n"), HasSubstr("map_from_odometry"));
  EXPECT_THAT(Refusal("silent_after_s = 100.0\n"), HasSubstr("forget_after_s"));
  EXPECT_THAT(Refusal("walk = 1.0\n"), HasSubstr("walk"));
}

TEST_F(Options, AFaultyCalibrationNamesItsLine) {
  folder_.Write("site/calibration.csv",
                "utime,tag,beacon,rssi_dbm,x_m,y_m\n1,t,a,-60,1.0,1.0\n2,t,a,strong,1.0,1.0\n");
  EXPECT_THAT(Refusal(""), HasSubstr("calibration.csv:3"));
}

TEST_F(Options, APlanWithoutFreeCellIsRefused) {
  folder_.Write("site/site.toml",
                "name = \"s\"\nobstacles = [[[-1.0, -1.0], [5.0, -1.0], [5.0, 5.0], [-1.0, 5.0]]]\n"
                "[area]\nmin = [0.0, 0.0]\nmax = [4.0, 4.0]\n"
                "[[beacons]]\nid = \"a\"\nposition = [0.0, 0.0, 1.0]\n");
  EXPECT_THAT(Refusal(""), HasSubstr("no free cell"));
}

}  // namespace
}  // namespace beckon
