#include "services/rssi_localizer/measurement_model.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "tests/rssi_localizer/example_site.hpp"

namespace beckon {
namespace {

using testing::ExampleCalibration;
using testing::ExamplePathLoss;
using testing::ExampleSite;

constexpr ModelParts kPlain{
    .offsets = false, .walls = false, .residual_map = false, .bodies = false, .histogram = false};

double Density(const MeasurementModel& model, const FloorGrid& grid, int beacon, double rssi,
               const Eigen::Vector2d& place) {
  CellValues sum(static_cast<std::size_t>(grid.size()), 0.0F);
  model.AddLogLikelihood(beacon, rssi, 1.0, sum);
  return std::exp(static_cast<double>(sum[static_cast<std::size_t>(grid.NearestCell(place))]));
}

class Models : public ::testing::Test {
 protected:
  Site site_ = ExampleSite();
  FloorGrid grid_{site_.plan, {.resolution_m = 0.25}};
  CalibrationSet calibration_ = CalibrationSet::Build(
      site_, ExampleCalibration(site_, ExamplePathLoss(), 1000, 4.0), Averaging::kDecibels);
};

TEST_F(Models, AreDensitiesOverRssi) {
  const ModelParts filtered{
      .offsets = true, .walls = false, .residual_map = true, .histogram = true};
  const MeasurementModel models[] = {
      BuildFittedModel(grid_, site_, calibration_, kPlain, {}).model,
      BuildFittedModel(grid_, site_, calibration_, filtered, {}).model,
      BuildMap2d(grid_, site_, calibration_)};
  for (const MeasurementModel& model : models) {
    for (const Eigen::Vector2d& place : {Eigen::Vector2d(1.1, 1.1), Eigen::Vector2d(9.0, 7.0)}) {
      double integral = 0.0;
      for (double rssi = -125.0; rssi < 15.0; rssi += 0.25) {
        integral += 0.25 * Density(model, grid_, 0, rssi, place);
      }
      EXPECT_NEAR(integral, 1.0, 0.03);
    }
  }
}

TEST_F(Models, LogNormalIsTheGaussianWithItsTail) {
  const FittedModel fitted = BuildFittedModel(grid_, site_, calibration_, kPlain, {});
  const Eigen::Vector2d place =
      grid_.centres()[static_cast<std::size_t>(grid_.NearestCell({6.0, 3.0}))];
  const double mean = fitted.path_loss.MeanRssi(BeaconDistance(site_.beacons[1], 1.0, place));
  const double sd = fitted.path_loss.sd_db;
  const double peak = Density(fitted.model, grid_, 1, mean, place);
  const auto gaussian = [](double x, double s) {
    return std::exp(-0.5 * x * x / (s * s)) / (s * std::sqrt(2.0 * std::numbers::pi));
  };
  EXPECT_NEAR(peak, 0.99 * (0.95 * gaussian(0.0, sd) + 0.05 * gaussian(0.0, 3.0 * sd)),
              0.01 * peak);
  // However wild a reading, it says no more than "wild".
  EXPECT_NEAR(Density(fitted.model, grid_, 1, mean - 55.0, place), 1e-4, 1e-5);
  EXPECT_EQ(Density(fitted.model, grid_, 1, -130.0, place),
            Density(fitted.model, grid_, 1, 20.0, place));
}

TEST_F(Models, ABodyWeakensAndNeverStrengthens) {
  ModelParts parts = kPlain;
  parts.bodies = true;
  const FittedModel with = BuildFittedModel(grid_, site_, calibration_, parts, {});
  const FittedModel without = BuildFittedModel(grid_, site_, calibration_, kPlain, {});
  const Eigen::Vector2d place =
      grid_.centres()[static_cast<std::size_t>(grid_.NearestCell({6.0, 3.0}))];
  const double mean = with.path_loss.MeanRssi(BeaconDistance(site_.beacons[1], 1.0, place));
  const auto ratio = [&](double off) {
    return Density(with.model, grid_, 1, mean + off, place) /
           Density(without.model, grid_, 1, mean + off, place);
  };
  EXPECT_GT(ratio(-14.0), 2.0);
  EXPECT_NEAR(ratio(8.0), 0.7, 0.1) << "seven in ten pass nobody";
}

TEST_F(Models, ReadingsOfDifferentBeaconsMultiply) {
  const MeasurementModel model = BuildFittedModel(grid_, site_, calibration_, kPlain, {}).model;
  const CellValues both =
      LogLikelihood(model, {{0, -60.0}, {2, -70.0}}, {.temper = 0.5}, grid_.size());
  CellValues one(both.size(), 0.0F);
  model.AddLogLikelihood(0, -60.0, 1.0, one);
  CellValues other(both.size(), 0.0F);
  model.AddLogLikelihood(2, -70.0, 1.0, other);
  for (std::size_t cell = 0; cell < both.size(); cell += 37) {
    EXPECT_NEAR(both[cell], 0.5F * (one[cell] + other[cell]), 1e-4F);
    EXPECT_NEAR(model.LogLikelihoodAt(0, -60.0, static_cast<int>(cell)), one[cell], 0.05);
  }
}

TEST_F(Models, OnlyTheStrongestAreUsedWhereSoChosen) {
  const MeasurementModel model = BuildFittedModel(grid_, site_, calibration_, kPlain, {}).model;
  const Heard heard = {{0, -80.0}, {1, -60.0}, {2, -70.0}};
  EXPECT_EQ(LogLikelihood(model, heard, {.temper = 1.0, .strongest = 2}, grid_.size()),
            LogLikelihood(model, {{1, -60.0}, {2, -70.0}}, {.temper = 1.0}, grid_.size()));
  EXPECT_EQ(LeastUsedRssi(heard, {.strongest = 2}), -70.0);
}

TEST_F(Models, LocateASimulatedTagAsWellAsTheTrueModel) {
  // Posterior mean under the model that made the readings: nothing can be better on average.
  const MeasurementModel fitted = BuildFittedModel(grid_, site_, calibration_, kPlain, {}).model;
  const CalibrationSet tags = CalibrationSet::Build(
      site_, ExampleCalibration(site_, ExamplePathLoss(), 300, 4.0, 99), Averaging::kDecibels);
  double error = 0.0;
  double best_error = 0.0;
  for (const CalibrationEpoch& epoch : tags.epochs) {
    CellValues probability = LogLikelihood(fitted, epoch.heard, {.temper = 1.0}, grid_.size());
    NormaliseLog(probability);
    error += (Summarise(grid_, probability).mean - epoch.position).norm();
    CellValues truth;
    for (const Eigen::Vector2d& centre : grid_.centres()) {
      double log = 0.0;
      for (const auto& [beacon, rssi] : epoch.heard) {
        const Beacon& at = site_.beacons[static_cast<std::size_t>(beacon)];
        const double off = rssi - ExamplePathLoss().MeanRssi(BeaconDistance(at, 1.0, centre));
        log -= 0.5 * off * off / 16.0;
      }
      truth.push_back(static_cast<float>(log));
    }
    NormaliseLog(truth);
    best_error += (Summarise(grid_, truth).mean - epoch.position).norm();
  }
  EXPECT_LT(error, 1.05 * best_error);
}

TEST_F(Models, TheMeasuredHistogramTellsWhatTheFormulaCannot) {
  // Half of the readings lose 12 dB, as where a metal cupboard stands in every other way: two
  // peaks.
  auto readings = ExampleCalibration(site_, ExamplePathLoss(), 2000, 1.5);
  for (std::size_t i = 0; i < readings.size(); i += 2) readings[i].reading.rssi_dbm -= 12.0;
  const CalibrationSet two_peaks = CalibrationSet::Build(site_, readings, Averaging::kDecibels);
  ModelParts parts = kPlain;
  parts.histogram = true;
  const FittedModel fitted = BuildFittedModel(grid_, site_, two_peaks, parts, {});
  const Eigen::Vector2d place =
      grid_.centres()[static_cast<std::size_t>(grid_.NearestCell({6.0, 3.0}))];
  const double mean = ExamplePathLoss().MeanRssi(BeaconDistance(site_.beacons[1], 1.0, place));
  const double between = Density(fitted.model, grid_, 1, mean - 6.0, place);
  EXPECT_GT(Density(fitted.model, grid_, 1, mean, place), 1.5 * between);
  EXPECT_GT(Density(fitted.model, grid_, 1, mean - 12.0, place), 1.5 * between);
}

TEST_F(Models, ThinColumnsFallBackOnTheFit) {
  // Calibrated near beacon "a" only: of distances of 8 m and more there are no readings.
  std::vector<CalibrationReading> near;
  for (const CalibrationReading& reading :
       ExampleCalibration(site_, ExamplePathLoss(), 3000, 4.0)) {
    if (reading.reading.beacon == "a" && reading.position.norm() < 4.0) near.push_back(reading);
  }
  const CalibrationSet calibration = CalibrationSet::Build(site_, near, Averaging::kDecibels);
  ModelParts parts = kPlain;
  const MeasurementModel fit = BuildFittedModel(grid_, site_, calibration, parts, {}).model;
  parts.histogram = true;
  const MeasurementModel map = BuildFittedModel(grid_, site_, calibration, parts, {}).model;
  for (double rssi = -90.0; rssi < -50.0; rssi += 5.0) {
    EXPECT_NEAR(Density(map, grid_, 0, rssi, {9.5, 7.5}), Density(fit, grid_, 0, rssi, {9.5, 7.5}),
                1e-3);
  }
}

TEST_F(Models, Map2dIsWhatWasCounted) {
  // Three readings of beacon "a" at one place, all others far from it.
  std::vector<CalibrationReading> readings;
  for (const double rssi : {-61.0, -61.5, -75.0}) {
    readings.push_back(
        {{static_cast<Utime>(readings.size()) * 2'000'000, "t", "a", rssi}, {3.0, 0.0}});
  }
  const MeasurementModel model =
      BuildMap2d(grid_, site_, CalibrationSet::Build(site_, readings, Averaging::kDecibels));
  const Eigen::Vector2d place(3.0, 0.1);
  EXPECT_NEAR(Density(model, grid_, 0, -60.5, place), 0.99 * 2.0 / 3.0 / 2.0, 1e-3);
  EXPECT_NEAR(Density(model, grid_, 0, -74.5, place), 0.99 / 3.0 / 2.0, 1e-3);
  EXPECT_NEAR(Density(model, grid_, 0, -90.0, place), 1e-4, 1e-5);
  EXPECT_NEAR(Density(model, grid_, 0, -90.0, {9.0, 7.0}), 0.01, 1e-3)
      << "nothing was measured there";
}

}  // namespace
}  // namespace beckon
