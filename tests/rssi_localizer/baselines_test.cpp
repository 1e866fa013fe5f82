#include "services/rssi_localizer/baselines.hpp"

#include <gmock/gmock.h>

#include "tests/rssi_localizer/example_site.hpp"

namespace beckon {
namespace {

using testing::ExampleCalibration;
using testing::ExamplePathLoss;
using testing::ExampleSite;

class Rivals : public ::testing::Test {
 protected:
  Baselines Make(const std::vector<CalibrationReading>& readings) {
    return Baselines(grid_, site_, CalibrationSet::Build(site_, readings, Averaging::kDecibels),
                     readings, {});
  }
  // What a tag hears without noise.
  Heard At(const Eigen::Vector2d& place) const {
    Heard heard;
    for (std::size_t b = 0; b < site_.beacons.size(); ++b) {
      heard.emplace_back(static_cast<int>(b), ExamplePathLoss().MeanRssi(BeaconDistance(
                                                  site_.beacons[b], site_.tag_height_m, place)));
    }
    return heard;
  }

  Site site_ = ExampleSite();
  FloorGrid grid_{site_.plan, {.resolution_m = 0.1}};
  std::vector<CalibrationReading> calibration_ =
      ExampleCalibration(site_, ExamplePathLoss(), 500, 0.5);
  Baselines rivals_ = Make(calibration_);
};

TEST_F(Rivals, AnswerTheAreaCentreWhereNothingIsHeard) {
  const Eigen::Vector2d centre(5.0, 4.0);
  EXPECT_LT((rivals_.AreaCentre() - centre).norm(), 1e-6);
  EXPECT_EQ(rivals_.WeightedCentroid({}), rivals_.AreaCentre());
  EXPECT_EQ(rivals_.MinMax({}), rivals_.AreaCentre());
  EXPECT_LT((rivals_.Rocrssi({}) - centre).norm(), 1e-6);
  EXPECT_EQ(rivals_.Cc2431({}), rivals_.AreaCentre());
  EXPECT_EQ(rivals_.Cc2431({{0, -50.0}, {1, -60.0}}), rivals_.AreaCentre()) << "needs three nodes";
}

TEST_F(Rivals, WeightedCentroidWeighsByPower) {
  // 10 dB more is ten times the weight.
  const Eigen::Vector2d position = rivals_.WeightedCentroid({{0, -60.0}, {1, -50.0}});
  EXPECT_NEAR(position.x(), 10.0 * 10.0 / 11.0, 1e-9);
  EXPECT_NEAR(position.y(), 0.0, 1e-9);
}

TEST_F(Rivals, MinMaxIsTheCentreOfTheCommonSquare) {
  // Beacons "a" and "c" in opposite corners, both 6 m away in the plane.
  const double rssi = ExamplePathLoss().MeanRssi(std::hypot(6.0, 1.0));
  const Eigen::Vector2d position = rivals_.MinMax({{0, rssi}, {2, rssi}});
  EXPECT_LT((position - Eigen::Vector2d(5.0, 4.0)).norm(), 0.02);
}

TEST_F(Rivals, FindATagWithoutNoise) {
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(2.0, 3.0), Eigen::Vector2d(7.5, 6.0)}) {
    EXPECT_LT((rivals_.Cc2431(At(place)) - place).norm(), 0.5);
    EXPECT_LT((rivals_.MinMax(At(place)) - place).norm(), 1.5);
    EXPECT_LT((rivals_.Rocrssi(At(place)) - place).norm(), 2.5);
    EXPECT_LT((rivals_.WeightedCentroid(At(place)) - place).norm(), 3.0);
  }
}

TEST_F(Rivals, RocrssiUsesMeasuredPowersBetweenBeacons) {
  // Measured, "b" is weak at "a" and "e" strong, so a tag between the two powers lies in a ring
  // from |ae| to the next beacon that is weaker: |ad|, as the model has it.
  auto readings = calibration_;
  for (int i = 0; i < 10; ++i) {
    readings.push_back({{i, "e", "a", -40.0}, {5.0, 4.0}});
    readings.push_back({{i, "b", "a", -95.0}, {10.0, 0.0}});
  }
  const Eigen::Vector2d position = Make(readings).Rocrssi({{0, -62.0}});
  // Centre of gravity of the ring sector between 6.4 m and 8 m around the corner.
  EXPECT_GT(position.norm(), 5.8);
  EXPECT_LT(position.norm(), 7.0);
}

TEST_F(Rivals, RocrssiDropsARingThatHasNoInside) {
  // Measured upside down: the far corner is heard better than the middle.
  auto readings = calibration_;
  for (int i = 0; i < 10; ++i) {
    readings.push_back({{i, "e", "a", -95.0}, {5.0, 4.0}});
    readings.push_back({{i, "c", "a", -40.0}, {10.0, 8.0}});
  }
  EXPECT_LT((Make(readings).Rocrssi({{0, -60.0}}) - Eigen::Vector2d(5.0, 4.0)).norm(), 0.05);
}

TEST_F(Rivals, Cc2431StaysWithinItsHardware) {
  // 30 dB weaker than the hardware's A allows: it still finds the best that it can be set to.
  PathLoss weak = ExamplePathLoss();
  weak.rssi_at_1m_dbm = -65.0;
  const auto readings = ExampleCalibration(site_, weak, 500, 0.5);
  const Baselines rivals = Make(readings);
  Heard heard = At({2.0, 3.0});
  for (auto& [beacon, rssi] : heard) rssi -= 15.0;
  EXPECT_LT((rivals.Cc2431(heard) - Eigen::Vector2d(2.0, 3.0)).norm(), 2.0);
}

}  // namespace
}  // namespace beckon
