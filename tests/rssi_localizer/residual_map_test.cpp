#include "services/rssi_localizer/residual_map.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

namespace beckon {
namespace {

constexpr ResidualKernel kKernel{.amplitude_db = 4.0, .length_m = 2.0, .noise_db = 2.0};

double Pattern(const Eigen::Vector2d& at) { return 4.0 * std::sin(at.x()) * std::cos(at.y()); }

std::vector<Residual> Measure(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(0.0, 6.0);
  std::normal_distribution<double> noise(0.0, 2.0);
  std::vector<Residual> residuals;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d at(place(random), place(random));
    residuals.push_back({at, Pattern(at) + noise(random)});
  }
  return residuals;
}

TEST(ResidualMap, LearnsAPatternWhereItWasMeasured) {
  const ResidualMap map(Measure(1000, 1), kKernel);
  double squares = 0.0;
  int places = 0;
  for (double x = 0.5; x < 6.0; x += 0.25) {
    for (double y = 0.5; y < 6.0; y += 0.25, ++places) {
      const double off = map.At({x, y}).mean_db - Pattern({x, y});
      squares += off * off;
    }
  }
  // The pattern's own standard deviation is 2 dB.
  EXPECT_LT(std::sqrt(squares / places), 0.9);
}

TEST(ResidualMap, ReturnsToNothingWhereNothingWasMeasured) {
  const ResidualMap map(Measure(300, 1), kKernel);
  const ResidualMap::Value far = map.At({100.0, 100.0});
  EXPECT_NEAR(far.mean_db, 0.0, 1e-6);
  EXPECT_NEAR(far.variance_db2, 16.0, 1e-6);
  EXPECT_LT(map.At({3.0, 3.0}).variance_db2, 4.0);
}

TEST(ResidualMap, OfOneReadingIsKnownInClosedForm) {
  const std::vector<Residual> one = {{{0.25, 0.25}, 10.0}};
  const ResidualMap map(one, kKernel);
  const double covariance = 16.0 * std::exp(-0.5);  // one metre away at a length of two
  EXPECT_NEAR(map.At({1.25, 0.25}).mean_db, 10.0 * covariance / 20.0, 1e-9);
  EXPECT_NEAR(map.At({1.25, 0.25}).variance_db2, 16.0 - covariance * covariance / 20.0, 1e-9);
}

TEST(ResidualMap, LeftOutValuesAreThoseOfAMapWithoutTheBin) {
  // Two readings in each of 20 bins.
  std::vector<Residual> residuals = Measure(20, 3);
  for (int i = 0; i < 20; ++i) {
    residuals[static_cast<std::size_t>(i)].position = {0.5 * (i % 5) + 0.25, 0.5 * (i / 5) + 0.25};
  }
  const ResidualMap whole(residuals, kKernel);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    std::vector<Residual> others = residuals;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const ResidualMap::Value expected = ResidualMap(others, kKernel).At(residuals[i].position);
    EXPECT_NEAR(whole.left_out()[i].mean_db, expected.mean_db, 1e-6);
    EXPECT_NEAR(whole.left_out()[i].variance_db2, expected.variance_db2, 1e-6);
  }
}

TEST(ResidualMap, ManyPlacesAtOnceAreAsOneByOne) {
  const ResidualMap map(Measure(300, 1), kKernel);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < 600; ++i) places.emplace_back(0.013 * i, 6.0 - 0.01 * i);
  const std::vector<ResidualMap::Value> values = map.At(places);
  ASSERT_EQ(values.size(), places.size());
  for (std::size_t i = 0; i < places.size(); i += 7) {
    EXPECT_NEAR(values[i].mean_db, map.At(places[i]).mean_db, 1e-9);
    EXPECT_NEAR(values[i].variance_db2, map.At(places[i]).variance_db2, 1e-9);
  }
}

TEST(ResidualMap, TheKernelIsAsLargeAsWhatItIsFittedTo) {
  // Rough, much stronger than the bulk of it made believe, and hardly any noise.
  std::vector<Residual> strong = Measure(1500, 5);
  for (Residual& residual : strong) {
    const double patch = std::floor(residual.position.x()) + std::floor(residual.position.y());
    residual.residual_db = (std::fmod(patch, 2.0) == 0.0 ? 15.0 : -15.0) + residual.residual_db / 8;
  }
  const ResidualKernel kernel = FitResidualKernel({strong}, 4.0);
  EXPECT_GT(kernel.amplitude_db, 10.0);
  EXPECT_LT(kernel.noise_db, 0.5 * kernel.amplitude_db);
}

TEST(ResidualMap, WithoutReadingsIsThePrior) {
  const ResidualMap map({}, kKernel);
  EXPECT_EQ(map.At({1.0, 1.0}).mean_db, 0.0);
  EXPECT_EQ(map.At({1.0, 1.0}).variance_db2, 16.0);
}

TEST(ResidualMap, PureNoiseIsNotTakenForAPattern) {
  std::vector<Residual> noise = Measure(800, 5);
  std::mt19937 random(7);
  std::normal_distribution<double> value(0.0, 4.0);
  for (Residual& residual : noise) residual.residual_db = value(random);
  const ResidualKernel of_noise = FitResidualKernel({noise}, 4.0);
  const ResidualKernel of_pattern = FitResidualKernel({Measure(800, 5)}, 2.8);
  EXPECT_LT(of_noise.amplitude_db / of_noise.noise_db,
            of_pattern.amplitude_db / of_pattern.noise_db);
}

}  // namespace
}  // namespace beckon
