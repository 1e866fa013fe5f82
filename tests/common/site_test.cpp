#include "common/site.hpp"

#include <gmock/gmock.h>

#include "common/config.hpp"
#include "common/csv.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using ::testing::HasSubstr;

constexpr char kSite[] = R"(name = "test"
[area]
min = [0.0, 0.0]
max = [5.0, 4.0]
outline = [[0, 0], [5, 0], [5, 4], [0, 4]]
[tag]
height_m = 1.2
[evaluation]
window_s = 0.4
[[walls]]
from = [2.0, 0.0]
to = [2.0, 3.0]
attenuation_db = 4.5
[[beacons]]
id = "a"
position = [0.1, 0.2, 2.0]
[[beacons]]
id = "b"
position = [4.9, 3.8, 2.1]
)";

class SiteTest : public ::testing::Test {
 protected:
  std::string LoadError(const std::string& text) {
    directory_.Write("site.toml", text);
    try {
      Site::Load(directory_.path());
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "no error";
  }
  static std::string Without(const std::string& part) {
    std::string text = kSite;
    return text.replace(text.find(part), part.size(), "");
  }
  testing::TempDir directory_;
};

TEST_F(SiteTest, ReadsAll) {
  directory_.Write("site.toml", kSite);
  const Site site = Site::Load(directory_.path());
  EXPECT_EQ(site.name, "test");
  EXPECT_EQ(site.plan.max, Eigen::Vector2d(5.0, 4.0));
  EXPECT_EQ(site.plan.outline.size(), 4U);
  ASSERT_EQ(site.plan.walls.size(), 1U);
  EXPECT_EQ(site.plan.walls[0].attenuation_db, 4.5);
  EXPECT_EQ(site.tag_height_m, 1.2);
  EXPECT_EQ(site.window_s, 0.4);
  EXPECT_EQ(site.BeaconIndex("b"), 1);
  EXPECT_EQ(site.BeaconIndex("c"), -1);
}

TEST_F(SiteTest, MissingAndWrongKeysAreNamed) {
  EXPECT_THAT(LoadError(Without("name = \"test\"\n")), HasSubstr("site.toml:1: name: is missing"));
  EXPECT_THAT(LoadError(Without("max = [5.0, 4.0]\n")),
              HasSubstr("site.toml:2: area.max: is missing"));
  EXPECT_THAT(LoadError(Without("position = [4.9, 3.8, 2.1]\n")),
              HasSubstr("beacons.position: is missing"));
  EXPECT_THAT(LoadError(std::string(kSite) + "[[beacons]]\nid = \"a\"\nposition = [1, 1, 1]\n"),
              HasSubstr("site.toml:21: beacons.id: beacon 'a' is declared twice"));
  EXPECT_THAT(LoadError("name = \"x\"\n[area]\nmin = [1, 0]\nmax = [0, 1]\n"),
              HasSubstr("area.max: has to be larger"));
}

TEST_F(SiteTest, ReadingsAreChecked) {
  directory_.Write("site.toml", kSite);
  const Site site = Site::Load(directory_.path());
  const auto error_of = [&](const std::string& rows) -> std::string {
    const auto path = directory_.Write("readings.csv", "utime,tag,beacon,rssi_dbm\n" + rows);
    try {
      LoadReadings(path, site);
    } catch (const FileError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of("1,t,a,-60\n2,t,b,-70.5\n"), "no error");
  EXPECT_THAT(error_of("1,t,a,-60\n2,t,z,-70\n"),
              HasSubstr("readings.csv:3: beacon 'z' is not declared"));
  EXPECT_THAT(error_of("1,t,a,nan\n"), HasSubstr(":2: 'rssi_dbm' has to be a number"));
}

TEST_F(SiteTest, ImpossiblePowersArePassedOver) {
  directory_.Write("site.toml", kSite);
  const Site site = Site::Load(directory_.path());
  const auto path = directory_.Write(
      "readings.csv", "utime,tag,beacon,rssi_dbm\n1,t,a,42\n2,t,a,-60\n3,t,b,-150\n");
  const auto readings = LoadReadings(path, site);
  ASSERT_EQ(readings.size(), 1U);
  EXPECT_EQ(readings[0].utime, 2);
}

TEST_F(SiteTest, RecordedSitesCanBeRead) {
  if (testing::SharedData().empty()) GTEST_SKIP() << testing::kNoSharedData;
  const auto folder = testing::SharedData() / "rssi";
  for (const char* name : {"flat_ble", "office_ble", "office2_ble", "house_zigbee/node1"}) {
    const Site site = Site::Load(folder / name);
    EXPECT_FALSE(LoadReadings(folder / name / "readings.csv", site).empty()) << name;
    EXPECT_FALSE(LoadCalibration(folder / name / "calibration.csv", site).empty()) << name;
    for (const auto& epoch : LoadTruth(folder / name / "truth.csv")) {
      EXPECT_TRUE((epoch.position.array() >= site.plan.min.array() - 0.5).all()) << name;
    }
  }
}

}  // namespace
}  // namespace beckon
