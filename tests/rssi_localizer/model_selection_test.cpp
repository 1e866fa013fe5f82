#include "services/rssi_localizer/model_selection.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/rssi_localizer/example_site.hpp"

namespace beckon {
namespace {

using testing::ExampleCalibration;
using testing::ExamplePathLoss;
using testing::ExampleSite;

ModelChoice Choose(const Site& site, const std::vector<CalibrationReading>& readings) {
  return ChooseModel(site, readings, {});
}

TEST(ModelSelection, APlainPlaceKeepsThePlainModel) {
  const Site site = ExampleSite();
  const ModelChoice choice = Choose(site, ExampleCalibration(site, ExamplePathLoss(), 600, 4.0));
  EXPECT_FALSE(choice.parts.offsets);
  EXPECT_FALSE(choice.parts.walls);
  EXPECT_FALSE(choice.parts.bodies);
  EXPECT_FALSE(choice.parts.histogram);
  // The readings are independent, so they deserve nearly full weight.
  EXPECT_GE(choice.trust.temper, 0.8);
  EXPECT_GT(choice.held_back_epochs, 100);
}

TEST(ModelSelection, OffsetsAreFound) {
  const Site site = ExampleSite();
  PathLoss truth = ExamplePathLoss();
  truth.offset_db = {6.0, -6.0, 0.0, 5.0, -5.0};
  // Few places: a residual map, which could stand for offsets too, has not enough to go by.
  EXPECT_TRUE(Choose(site, ExampleCalibration(site, truth, 40, 3.0)).parts.offsets);
}

TEST(ModelSelection, ThickWallsAreFound) {
  Site site = ExampleSite();
  site.plan.walls = {{{3.0, 0.0}, {3.0, 8.0}, std::nullopt},
                     {{7.0, 0.0}, {7.0, 8.0}, std::nullopt}};
  PathLoss truth = ExamplePathLoss();
  truth.wall_db = 8.0;
  // Few places: a residual map has not enough to go by.
  EXPECT_TRUE(Choose(site, ExampleCalibration(site, truth, 40, 3.0)).parts.walls);
}

TEST(ModelSelection, APatternOverTheFloorIsFound) {
  const Site site = ExampleSite();
  auto readings = ExampleCalibration(site, ExamplePathLoss(), 600, 3.0);
  for (CalibrationReading& reading : readings) {
    const double phase = reading.reading.beacon[0];
    reading.reading.rssi_dbm +=
        8.0 * std::sin(reading.position.x() + phase) * std::sin(reading.position.y() + phase);
  }
  EXPECT_TRUE(Choose(site, readings).parts.residual_map);
}

// Each place is heard five times, with fading that `fade_db` draws.
std::vector<CalibrationReading> Faded(const Site& site, const std::function<double()>& fade_db) {
  std::vector<CalibrationReading> readings;
  for (const CalibrationReading& still : ExampleCalibration(site, ExamplePathLoss(), 400, 0.5)) {
    for (int i = 0; i < 5; ++i) {
      CalibrationReading& reading = readings.emplace_back(still);
      reading.reading.utime += 100'000 * i;
      reading.reading.rssi_dbm += fade_db();
    }
  }
  return readings;
}

TEST(ModelSelection, ReadingsAreAveragedAsTheirFadingAsksFor) {
  const Site site = ExampleSite();
  std::mt19937 random(3);
  std::exponential_distribution<double> rayleigh_power;
  const auto rayleigh =
      Faded(site, [&] { return 10.0 * std::log10(std::max(1e-6, rayleigh_power(random))); });
  EXPECT_EQ(Choose(site, rayleigh).averaging, Averaging::kPower);
  std::normal_distribution<double> normal(0.0, 6.0);
  const auto log_normal = Faded(site, [&] { return normal(random); });
  EXPECT_EQ(Choose(site, log_normal).averaging, Averaging::kDecibels);
}

TEST(ModelSelection, ErrorsInCommonLowerTheTrust) {
  // Four radios in each beacon say the same thing four times: a quarter of the weight is right.
  Site site = ExampleSite();
  const auto once = ExampleCalibration(site, ExamplePathLoss(), 300, 5.0);
  for (const Beacon& beacon : ExampleSite().beacons) {
    for (const char* copy : {"1", "2", "3"})
      site.beacons.push_back({beacon.id + copy, beacon.position});
  }
  std::vector<CalibrationReading> four_times;
  for (CalibrationReading reading : once) {
    const std::string id = reading.reading.beacon;
    for (const char* copy : {"", "1", "2", "3"}) {
      reading.reading.beacon = id + copy;
      four_times.push_back(reading);
    }
  }
  EXPECT_NEAR(Choose(site, four_times).trust.temper, 0.25, 0.11);
}

TEST(ModelSelection, FewPlacesAreTrustedLess) {
  const Site site = ExampleSite();
  const double few = Choose(site, ExampleCalibration(site, ExamplePathLoss(), 5, 4.0)).trust.temper;
  const double many =
      Choose(site, ExampleCalibration(site, ExamplePathLoss(), 300, 4.0)).trust.temper;
  EXPECT_LT(few, 0.75 * many);
}

TEST(ModelSelection, LinksBetweenBeaconsAreHeldBackInBothDirections) {
  // Five beacons that hear each other. Each link has a strength of its own, the same both ways: who
  // has heard one end seems to know the other.
  const Site site = ExampleSite();
  std::vector<CalibrationReading> readings;
  for (std::size_t a = 0; a < site.beacons.size(); ++a) {
    for (std::size_t b = 0; b < site.beacons.size(); ++b) {
      if (a == b) continue;
      const double link_db = (a * b + a + b) % 3 == 0 ? 14.0 : -7.0;
      const double distance_m = (site.beacons[a].position - site.beacons[b].position).norm();
      readings.push_back({{static_cast<Utime>(a) * 10'000'000, site.beacons[a].id,
                           site.beacons[b].id, ExamplePathLoss().MeanRssi(distance_m) + link_db},
                          site.beacons[a].position.head<2>()});
    }
  }
  const ModelChoice choice = Choose(site, readings);
  EXPECT_EQ(choice.held_back_epochs, 5);
  EXPECT_LT(choice.trust.temper, 1.0);
  EXPECT_GT(choice.held_back_error_m, 2.0);
}

// A survey of few places, and what the robot heard at many, of the same radio.
std::vector<CalibrationReading> SurveyAndRobot(const Site& site, const PathLoss& of_robot) {
  PathLoss radio = ExamplePathLoss();
  radio.offset_db = {6.0, -6.0, 0.0, 5.0, -5.0};
  std::vector<CalibrationReading> readings = ExampleCalibration(site, radio, 8, 4.0);
  for (CalibrationReading own : ExampleCalibration(site, of_robot, 300, 4.0, 7)) {
    own.by_robot = true;
    readings.push_back(own);
  }
  return readings;
}

TEST(ModelSelection, TheRobotsOwnReadingsAreUsedWhereTheyAgreeWithTheSurvey) {
  const Site site = ExampleSite();
  PathLoss radio = ExamplePathLoss();
  radio.offset_db = {6.0, -6.0, 0.0, 5.0, -5.0};
  const ModelChoice choice = Choose(site, SurveyAndRobot(site, radio));
  EXPECT_TRUE(choice.parts.by_robot);
  EXPECT_EQ(choice.held_back_epochs, 8) << "it is the survey that judges";
  // A robot that took itself to be elsewhere, or heard beacons that have changed places since.
  radio.offset_db = {-15.0, 15.0, 0.0, -15.0, 15.0};
  EXPECT_FALSE(Choose(site, SurveyAndRobot(site, radio)).parts.by_robot);
}

TEST(ModelSelection, WithoutASurveyTheRobotsReadingsAreJudgedByThemselves) {
  const Site site = ExampleSite();
  PathLoss radio = ExamplePathLoss();
  radio.rssi_at_1m_dbm = -70.0;  // far from what is expected
  std::vector<CalibrationReading> own = ExampleCalibration(site, radio, 200, 4.0);
  for (CalibrationReading& reading : own) reading.by_robot = true;
  const ModelChoice choice = Choose(site, own);
  EXPECT_TRUE(choice.parts.by_robot);
  EXPECT_GT(choice.held_back_epochs, 100);
}

TEST(ModelSelection, TooFewPlacesLeaveTheDefault) {
  const Site site = ExampleSite();
  EXPECT_EQ(Choose(site, {}).held_back_epochs, 0);
  EXPECT_EQ(Choose(site, ExampleCalibration(site, ExamplePathLoss(), 2, 4.0)).held_back_epochs, 0);
}

}  // namespace
}  // namespace beckon
