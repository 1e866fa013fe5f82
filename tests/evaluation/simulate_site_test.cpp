#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "services/rssi_localizer/floor_grid.hpp"
#include "tools/evaluation/localization/evaluate.hpp"
#include "tools/site_simulation/simulated_site.hpp"

namespace beckon {
namespace {

TEST(ShadowingField, HasTheVarianceAndCorrelationStated) {
  constexpr int kFields = 400;
  std::mt19937_64 random(1);
  double variance = 0.0;
  double at_one_length = 0.0;
  for (int i = 0; i < kFields; ++i) {
    const ShadowingField field(2.0, random);
    for (int k = 0; k < 10; ++k) {
      const Eigen::Vector2d at(7.0 * k, -3.0 * k);
      const double here = field.At(at);
      variance += here * here;
      at_one_length += here * field.At(at + Eigen::Vector2d(1.2, 1.6));
    }
  }
  EXPECT_NEAR(variance / (10 * kFields), 1.0, 0.1);
  EXPECT_NEAR(at_one_length / (10 * kFields), std::exp(-1.0), 0.07);
}

TEST(SimulateSite, PlacesAreAsLargeAsTheThesisSays) {
  const auto area = [](const Place& place) {
    const FloorGrid grid(place.site.plan, {.resolution_m = 0.1});
    return grid.size() * grid.cell_area_m2();
  };
  EXPECT_NEAR(area(ThesisPlace("EE1")), 49.0, 2.0);
  EXPECT_NEAR(area(ThesisPlace("EE2")), 30.0, 0.5);
  EXPECT_NEAR(area(ThesisPlace("EE3")), 600.0, 5.0);
  EXPECT_EQ(ThesisPlace("EE1").points.size(), 26U);
  EXPECT_EQ(ThesisPlace("EE2").points.size(), 21U);
  EXPECT_EQ(ThesisPlace("EE3").points.size(), 60U);
  EXPECT_THROW(ThesisPlace("EE4"), std::invalid_argument);
}

TEST(SimulateSite, TheOracleIsTheBestAndMinMaxErrsAsInTheThesis) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "simulate_site_test";
  std::map<std::string, double> mean;
  constexpr int kSeeds = 3;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::filesystem::remove_all(folder);
    WriteSimulatedSite(ThesisPlace("EE2"), seed, folder);
    for (const auto& [name, errors] : EvaluateSite(folder, {}).methods) {
      mean[name] += std::accumulate(errors.error_m.begin(), errors.error_m.end(), 0.0) /
                    static_cast<double>(errors.error_m.size()) / kSeeds;
    }
  }
  std::filesystem::remove_all(folder);
  EXPECT_NEAR(mean.at("min_max"), 2.46, 0.5);
  EXPECT_LT(mean.at("map_filtered"), 0.45 * mean.at("min_max"));
  for (const char* rival : {"weighted_centroid", "min_max", "rocrssi", "cc2431", "map_2d"}) {
    EXPECT_LT(mean.at("map_filtered"), mean.at(rival)) << rival;
  }
  EXPECT_LT(mean.at("oracle"), mean.at("map_filtered"));
}

}  // namespace
}  // namespace beckon
