#include "services/rssi_localizer/posterior.hpp"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <algorithm>

#include <cmath>
#include <limits>
#include <numbers>

namespace beckon {
namespace {

FloorGrid Room(double width, double height, double resolution) {
  FloorPlan plan;
  plan.max = {width, height};
  return FloorGrid(plan, {.resolution_m = resolution});
}

TEST(Posterior, OfAnEvenRoomIsKnownInClosedForm) {
  const FloorGrid grid = Room(6.0, 4.0, 0.1);
  CellValues probability(static_cast<std::size_t>(grid.size()), 0.0F);
  NormaliseLog(probability);
  const Estimate estimate = Summarise(grid, probability);
  EXPECT_NEAR(estimate.mean.x(), 3.0, 1e-4);
  EXPECT_NEAR(estimate.mean.y(), 2.0, 1e-4);
  EXPECT_NEAR(estimate.covariance(0, 0), 6.0 * 6.0 / 12.0, 1e-3);
  EXPECT_NEAR(estimate.covariance(1, 1), 4.0 * 4.0 / 12.0, 1e-3);
  EXPECT_NEAR(estimate.covariance(0, 1), 0.0, 1e-4);
  EXPECT_NEAR(estimate.area_90_m2, 0.9 * 24.0, 0.02);
}

TEST(Posterior, OfAGaussianIsKnownInClosedForm) {
  const FloorGrid grid = Room(10.0, 10.0, 0.05);
  const Eigen::Vector2d centre(4.0, 6.0);
  Eigen::Matrix2d covariance;
  covariance << 0.5, 0.2, 0.2, 0.3;
  const Eigen::Matrix2d information = covariance.inverse();
  CellValues probability;
  for (const Eigen::Vector2d& cell : grid.centres()) {
    const Eigen::Vector2d off = cell - centre;
    probability.push_back(static_cast<float>(-0.5 * off.dot(information * off)));
  }
  NormaliseLog(probability);
  const Estimate estimate = Summarise(grid, probability);
  EXPECT_LT((estimate.mean - centre).norm(), 1e-3);
  EXPECT_LT((estimate.covariance - covariance).norm(), 2e-3);
  // The ellipse that holds 90 % of a Gaussian: chi-squared with two degrees of freedom.
  const double area = 2.0 * std::numbers::pi * std::sqrt(covariance.determinant()) * std::log(10.0);
  EXPECT_NEAR(estimate.area_90_m2, area, 0.01 * area);

  const CellValues levels = CredibleLevels(probability);
  const auto inside = std::count_if(levels.begin(), levels.end(), [](float l) { return l < 0.9F; });
  EXPECT_NEAR(static_cast<double>(inside) * grid.cell_area_m2(), estimate.area_90_m2, 0.01);
  EXPECT_EQ(levels[static_cast<std::size_t>(grid.NearestCell({9.9, 0.1}))], 1.0F);
}

TEST(Posterior, NormalisingKeepsRatiosOfVeryUnlikelyCells) {
  CellValues values = {-5000.0F, -5001.0F};
  NormaliseLog(values);
  EXPECT_NEAR(static_cast<double>(values[0]), 1.0 / (1.0 + std::exp(-1.0)), 1e-6);
  EXPECT_NEAR(static_cast<double>(values[0] + values[1]), 1.0, 1e-6);
}

TEST(Posterior, NonsenseIsRefused) {
  CellValues nan = {0.0F, std::nanf("")};
  EXPECT_THROW(NormaliseLog(nan), std::invalid_argument);
  CellValues impossible(3, -std::numeric_limits<float>::infinity());
  EXPECT_THROW(NormaliseLog(impossible), std::invalid_argument);
}

}  // namespace
}  // namespace beckon
