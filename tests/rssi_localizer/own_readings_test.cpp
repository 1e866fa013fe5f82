#include "services/rssi_localizer/own_readings.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "common/csv.hpp"
#include "tests/rssi_localizer/example_site.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

class OwnReadingsFile : public ::testing::Test {
 protected:
  std::vector<CalibrationReading> Load() const { return LoadRobotCalibration(file_, site_); }

  const Site site_ = testing::ExampleSite();
  testing::TempDir folder_;
  const std::filesystem::path file_ = folder_.path() / "own.csv";
};

TEST_F(OwnReadingsFile, HoldsAWindowEveryHalfMetre) {
  {
    OwnReadings own(file_, 0, 1.0);
    // 0.1 m and two readings each half second.
    for (int i = 0; i < 40; ++i) {
      const Utime utime = 500'000LL * i;
      EXPECT_TRUE(own.Add({utime, "robot", "a", -60.0 - i}, {0.1 * i, 2.0}));
      EXPECT_TRUE(own.Add({utime + 1, "robot", "b", -70.0}, {0.1 * i, 2.0}));
    }
  }
  const std::vector<CalibrationReading> readings = Load();
  // At 0, 0.5, ... 3.5 m a window of a second, in which two of each beacon lie.
  ASSERT_EQ(readings.size(), 8U * 4U);
  EXPECT_EQ(readings[0].reading.tag, "robot");
  EXPECT_EQ(readings[0].reading.beacon, "a");
  EXPECT_EQ(readings[4].reading.rssi_dbm, -65.0);
  EXPECT_NEAR(readings[4].position.x(), 0.5, 1e-9);
  EXPECT_EQ(readings[4].reading.utime, 2'500'000);
  EXPECT_TRUE(readings[4].by_robot);
}

TEST_F(OwnReadingsFile, WhereTheRobotStandsItLearnsOnce) {
  OwnReadings own(file_, 0, 1.0);
  for (int i = 0; i < 100; ++i) own.Add({1'000'000LL * i, "robot", "a", -60.0}, {1.0, 2.0});
  EXPECT_EQ(Load().size(), 1U);
}

TEST_F(OwnReadingsFile, IsGoneOnWithAfterHalfALine) {
  folder_.Write("own.csv",
                "utime,tag,beacon,rssi_dbm,x_m,y_m\n1,robot,a,-60,1,1\n2,robot,gone,-60,1,1\n"
                "3,robot,a,-6");
  ASSERT_EQ(Load().size(), 1U);
  {
    OwnReadings own(file_, 1, 1.0);
    own.Add({9, "robot", "b", -71.0}, {3.0, 2.0});
  }
  const std::vector<CalibrationReading> readings = Load();
  ASSERT_EQ(readings.size(), 2U);
  EXPECT_EQ(readings[1].reading.beacon, "b");
}

TEST_F(OwnReadingsFile, StopsWhereItIsFull) {
  OwnReadings own(file_, OwnReadings::kMostReadings - 1, 1.0);
  own.Add({1, "robot", "a", -60.0}, {1.0, 1.0});
  own.Add({2, "robot", "b", -60.0}, {1.0, 1.0});
  EXPECT_EQ(Load().size(), 1U);
}

TEST_F(OwnReadingsFile, AnotherFileOrNoFolderIsRefused) {
  EXPECT_THROW(OwnReadings(folder_.path() / "nowhere" / "own.csv", 0, 1.0), FileError);
  folder_.Write("own.csv", "name = \"robot\"\n");
  EXPECT_THROW(Load(), FileError);
}

}  // namespace
}  // namespace beckon
