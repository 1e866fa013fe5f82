#include "common/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace beckon {
namespace {

TEST(Quantile, InterpolatesBetweenValues) {
  EXPECT_DOUBLE_EQ(Quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(Quantile({4.0, 1.0, 3.0, 2.0}, 1.0), 4.0);
  EXPECT_TRUE(std::isnan(Quantile({}, 0.5)));
}

TEST(Statistics, OfFourValues) {
  const std::vector<double> values = {2.0, 4.0, 4.0, 6.0};
  EXPECT_DOUBLE_EQ(Mean(values), 4.0);
  EXPECT_DOUBLE_EQ(StandardDeviation(values), std::sqrt(2.0));
  EXPECT_EQ(StandardDeviation({3.0}), 0.0);
}

TEST(Statistics, OfNothingAreNoNumbers) {
  EXPECT_TRUE(std::isnan(Mean({})));
  EXPECT_TRUE(std::isnan(StandardDeviation({})));
}

}  // namespace
}  // namespace beckon
