#include "services/rssi_localizer/path_loss.hpp"

#include <gmock/gmock.h>

#include "tests/rssi_localizer/example_site.hpp"

namespace beckon {
namespace {

using testing::ExampleCalibration;
using testing::ExamplePathLoss;
using testing::ExampleSite;

std::vector<double> Crossings(const Site& site, const CalibrationSet& set) {
  const WallCounter walls(site.plan);
  std::vector<double> crossed;
  for (const CalibrationSample& sample : set.samples) {
    crossed.push_back(walls.Crossed(
        site.beacons[static_cast<std::size_t>(sample.beacon)].position.head<2>(), sample.position));
  }
  return crossed;
}

TEST(PathLoss, DistanceIsTheInverseOfRssi) {
  const PathLoss path_loss = ExamplePathLoss();
  for (const double distance : {0.5, 1.0, 7.3, 40.0}) {
    EXPECT_NEAR(path_loss.Distance(path_loss.MeanRssi(distance)), distance, 1e-9);
  }
}

TEST(PathLoss, IsRecoveredFromReadings) {
  const Site site = ExampleSite();
  const auto set = CalibrationSet::Build(
      site, ExampleCalibration(site, ExamplePathLoss(), 500, 4.0), Averaging::kDecibels);
  PathLossFitOptions options;
  options.fit_offsets = false;
  const PathLoss fit = FitPathLoss(set.samples, 5, {}, options);
  EXPECT_NEAR(fit.rssi_at_1m_dbm, -50.0, 1.0);
  EXPECT_NEAR(fit.exponent, 2.2, 0.15);
  EXPECT_NEAR(fit.sd_db, 4.0, 0.4);
}

TEST(PathLoss, ATenthOfWildReadingsDoesNoHarm) {
  const Site site = ExampleSite();
  auto readings = ExampleCalibration(site, ExamplePathLoss(), 500, 2.0);
  for (std::size_t i = 0; i < readings.size(); i += 10) readings[i].reading.rssi_dbm = -110.0;
  PathLossFitOptions options;
  options.fit_offsets = false;
  const PathLoss fit = FitPathLoss(
      CalibrationSet::Build(site, readings, Averaging::kDecibels).samples, 5, {}, options);
  EXPECT_NEAR(fit.rssi_at_1m_dbm, -50.0, 1.5);
  EXPECT_NEAR(fit.exponent, 2.2, 0.2);
}

TEST(PathLoss, OffsetsOfBeaconsAreRecovered) {
  const Site site = ExampleSite();
  PathLoss truth = ExamplePathLoss();
  truth.offset_db = {4.0, -4.0, 0.0, 2.0, -2.0};
  const auto set =
      CalibrationSet::Build(site, ExampleCalibration(site, truth, 500, 3.0), Averaging::kDecibels);
  const PathLoss fit = FitPathLoss(set.samples, 5, {}, {});
  for (std::size_t b = 0; b < 5; ++b) EXPECT_NEAR(fit.offset_db[b], truth.offset_db[b], 1.2) << b;
}

TEST(PathLoss, AttenuationOfWallsIsRecovered) {
  Site site = ExampleSite();
  site.plan.walls = {{{3.0, 0.0}, {3.0, 8.0}, std::nullopt},
                     {{7.0, 0.0}, {7.0, 6.0}, std::nullopt}};
  PathLoss truth = ExamplePathLoss();
  truth.wall_db = 5.0;
  const auto set =
      CalibrationSet::Build(site, ExampleCalibration(site, truth, 500, 3.0), Averaging::kDecibels);
  const PathLoss fit = FitPathLoss(set.samples, 5, Crossings(site, set), {});
  EXPECT_NEAR(fit.wall_db, 5.0, 0.7);
}

TEST(PathLoss, WithoutReadingsIsWhatWasExpected) {
  const PathLoss fit = FitPathLoss({}, 5, {}, {});
  EXPECT_EQ(fit.rssi_at_1m_dbm, PathLoss{}.rssi_at_1m_dbm);
  EXPECT_EQ(fit.exponent, PathLoss{}.exponent);
}

TEST(PathLoss, OnePlaceDoesNotMakeAModelRunAway) {
  const Site site = ExampleSite();
  std::vector<CalibrationReading> readings;
  for (int i = 0; i < 100; ++i) readings.push_back({{i * 2'000'000, "t", "a", -90.0}, {0.5, 0.5}});
  const PathLoss fit =
      FitPathLoss(CalibrationSet::Build(site, readings, Averaging::kDecibels).samples, 5, {}, {});
  EXPECT_GT(fit.exponent, 1.0);
  EXPECT_LT(fit.exponent, 4.0);
  EXPECT_GT(fit.sd_db, 1.0);
}

TEST(WallCounter, CountsFacesAndForgivesBeaconsOnWalls) {
  FloorPlan plan;
  plan.outline = {{0.0, 0.0}, {4.0, 0.0}, {4.0, 4.0}, {0.0, 4.0}};
  plan.walls = {{{2.0, 0.0}, {2.0, 4.0}, std::nullopt}};
  plan.obstacles = {{{2.5, 1.0}, {3.0, 1.0}, {3.0, 3.0}, {2.5, 3.0}}};
  const WallCounter walls(plan);
  EXPECT_EQ(walls.Crossed({0.0, 2.0}, {1.0, 2.0}), 0.0) << "hangs on the outline";
  EXPECT_EQ(walls.Crossed({0.0, 2.0}, {3.5, 2.0}), 1.0) << "furniture is no wall";
  EXPECT_EQ(walls.Crossed({-1.0, 2.0}, {3.5, 2.0}), 2.0);
  EXPECT_EQ(walls.Crossed({1.0, 1.0}, {1.0, 1.0}), 0.0);
}

TEST(CalibrationSet, TakesTheMeanOfAWindowAndLeavesOutTheImpossible) {
  const Site site = ExampleSite();
  const std::vector<CalibrationReading> readings = {
      {{400'000, "t", "a", -62.0}, {2.0, 1.0}},      {{0, "t", "a", -60.0}, {1.0, 1.0}},
      {{500'000, "t", "b", -70.0}, {2.5, 1.0}},      {{600'000, "t", "a", 80.0}, {2.5, 1.0}},
      {{700'000, "t", "nobody", -50.0}, {2.5, 1.0}}, {{1'000'000, "t", "a", -64.0}, {3.0, 1.0}}};
  const CalibrationSet set = CalibrationSet::Build(site, readings, Averaging::kDecibels);
  ASSERT_EQ(set.epochs.size(), 2U);
  EXPECT_THAT(set.epochs[0].heard,
              ::testing::ElementsAre(std::pair(0, -61.0), std::pair(1, -70.0)));
  EXPECT_NEAR(set.epochs[0].position.x(), (1.0 + 2.0 + 2.5) / 3.0, 1e-12) << "on average";
  EXPECT_EQ(set.samples[0].position, Eigen::Vector2d(1.5, 1.0)) << "where it was heard on average";
  EXPECT_THAT(set.epochs[1].heard, ::testing::ElementsAre(std::pair(0, -64.0)));
}

TEST(RssiMean, IsThatOfThePowerOrOfTheDecibels) {
  RssiMean power(Averaging::kPower);
  RssiMean decibels(Averaging::kDecibels);
  for (const double rssi_dbm : {-60.0, -70.0}) {
    power.Add(rssi_dbm);
    decibels.Add(rssi_dbm);
  }
  EXPECT_NEAR(power.rssi_dbm(), -62.596, 0.001);  // 10 log10((1 + 0.1) / 2) above -60
  EXPECT_EQ(decibels.rssi_dbm(), -65.0);
  EXPECT_EQ(power.count(), 2);
}

}  // namespace
}  // namespace beckon
