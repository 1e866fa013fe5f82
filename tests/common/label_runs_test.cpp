#include "common/label_runs.hpp"

#include <gmock/gmock.h>

#include <random>
#include <stdexcept>

namespace beckon {
namespace {

cv::Mat RandomLabels(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  cv::Mat labels(height, width, CV_8UC1);
  std::uint8_t label = 0;
  for (int i = 0; i < width * height; ++i) {
    if (random() % 17 == 0) label = static_cast<std::uint8_t>(random() % 3);
    labels.data[i] = label;
  }
  return labels;
}

TEST(LabelRuns, RoundTrip) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const cv::Mat labels =
        RandomLabels(1 + static_cast<int>(seed) * 7, 1 + static_cast<int>(seed) * 3, seed);
    const auto runs = EncodeLabels(labels);
    const cv::Mat decoded = DecodeLabels(runs, labels.cols, labels.rows);
    EXPECT_EQ(cv::norm(labels, decoded, cv::NORM_INF), 0.0);
  }
}

TEST(LabelRuns, OneColourIsAFewBytes) {
  const auto runs = EncodeLabels(cv::Mat(480, 640, CV_8UC1, cv::Scalar(kGround)));
  // 640 * 480 << 2 | 1 = 1228801 = 0x12C001, low seven bits first.
  EXPECT_THAT(runs, ::testing::ElementsAre(0x81, 0x80, 0x4B));
}

TEST(LabelRuns, PartOfALargerImage) {
  const cv::Mat whole = RandomLabels(40, 30, 5);
  const cv::Mat part = whole(cv::Rect(3, 4, 20, 10));
  const cv::Mat decoded = DecodeLabels(EncodeLabels(part), 20, 10);
  EXPECT_EQ(cv::norm(part, decoded, cv::NORM_INF), 0.0);
}

TEST(LabelRuns, NonsenseIsRefused) {
  const auto runs = EncodeLabels(RandomLabels(20, 10, 1));
  EXPECT_THROW(DecodeLabels(runs, 20, 11), std::invalid_argument) << "too short";
  EXPECT_THROW(DecodeLabels(runs, 20, 9), std::invalid_argument) << "too long";
  EXPECT_THROW(DecodeLabels(runs, 0, 10), std::invalid_argument);
  EXPECT_THROW(DecodeLabels(runs, 1 << 30, 1 << 30), std::invalid_argument);
  const std::vector<std::uint8_t> cut = {0x81, 0x80};
  EXPECT_THROW(DecodeLabels(cut, 20, 10), std::invalid_argument);
  const std::vector<std::uint8_t> endless(20, 0xFF);
  EXPECT_THROW(DecodeLabels(endless, 20, 10), std::invalid_argument);
  EXPECT_THROW(EncodeLabels(cv::Mat()), std::invalid_argument);
  EXPECT_THROW(EncodeLabels(cv::Mat(2, 2, CV_8UC1, cv::Scalar(4))), std::invalid_argument);
}

}  // namespace
}  // namespace beckon
