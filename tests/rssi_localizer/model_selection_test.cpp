#include "services/rssi_localizer/model_selection.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/rssi_localizer/example_site.hpp"

namespace beckon {
namespace {

using testing::ExampleCalibration;
using testing::ExamplePathLoss;
using testing::ExampleSite;

ModelChoice Choose(const Site& site, const std::vector<CalibrationReading>& readings) {
  return ChooseModel(site, CalibrationSet::Build(site, readings), {});
}

TEST(ModelSelection, APlainPlaceKeepsThePlainModel) {
  const Site site = ExampleSite();
  const ModelChoice choice = Choose(site, ExampleCalibration(site, ExamplePathLoss(), 600, 4.0));
  EXPECT_FALSE(choice.parts.offsets);
  EXPECT_FALSE(choice.parts.walls);
  EXPECT_FALSE(choice.parts.residual_map);
  EXPECT_FALSE(choice.parts.bodies);
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

TEST(ModelSelection, TooFewPlacesLeaveTheDefault) {
  const Site site = ExampleSite();
  EXPECT_EQ(Choose(site, {}).held_back_epochs, 0);
  EXPECT_EQ(Choose(site, ExampleCalibration(site, ExamplePathLoss(), 2, 4.0)).held_back_epochs, 0);
}

}  // namespace
}  // namespace beckon
