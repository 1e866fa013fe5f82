// Scores of the ground detector against counts done by hand, and sequence folders good and bad.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/csv.hpp"
#include "common/jpeg.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"
#include "tools/evaluation/ground/evaluate.hpp"
#include "tools/evaluation/ground/scoring.hpp"

namespace beckon {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(CountPixels, CountsWhatIsJudged) {
  // Truth: 0 not judged, 1 ground, 2 not ground.
  const cv::Mat truth = (cv::Mat_<std::uint8_t>(2, 4) << 0, 1, 1, 1, 0, 2, 2, 2);
  const cv::Mat labels = (cv::Mat_<std::uint8_t>(2, 4) << 1, 1, 2, 0, 2, 2, 1, 0);
  const PixelCounts counts = CountPixels(labels, truth);
  EXPECT_EQ(counts.judged, 6);
  EXPECT_EQ(counts.ground, 3);
  EXPECT_EQ(counts.ground_found, 1);
  EXPECT_EQ(counts.obstacle_as_ground, 1);
  EXPECT_EQ(counts.undetermined, 2);
  // Undetermined counts as not ground: one ground pixel of each kind is lost, one obstacle is
  // ground.
  EXPECT_DOUBLE_EQ(counts.RegionFalseRate(), 3.0 / 6.0);
  EXPECT_THROW(CountPixels(labels, truth.colRange(0, 3)), std::invalid_argument);
}

TEST(CompareRanges, SortsRangesByHowTheyErr) {
  VirtualScan scan;
  scan.first_bearing_rad = -0.3;
  scan.bearing_step_rad = 0.1;
  scan.ranges_m = {2.0F, 2.2F, 2.5F, 1.5F, kInf, kNaN, 2.0F};
  const std::vector<float> nearest(7, 0.5F);
  std::vector<TrueRange> truth;
  for (int i = 0; i < 7; ++i) truth.push_back({-0.3 + 0.1 * i, 2.0});
  truth[6].range_m = 7.0;        // beyond the maximum
  truth.push_back({0.0, 0.4});   // nearer than can be seen
  truth.push_back({0.0, kInf});  // nothing there
  truth.push_back({1.0, 2.0});   // beside the scan
  RangeErrors errors;
  CompareRanges(scan, nearest, truth, 6.0, errors);
  EXPECT_EQ(errors.judged, 6);
  EXPECT_EQ(errors.missed, 2);   // 2.5 and nothing met
  EXPECT_EQ(errors.phantom, 1);  // 1.5
  EXPECT_EQ(errors.undetermined, 1);
  EXPECT_THAT(errors.relative,
              ::testing::Pointwise(::testing::DoubleNear(1e-6), {0.0, 0.1, 0.25, -0.25}));
}

// A camera 0.5 m up; three frames in a row would be needed for a score, so frames are added by
// hand.
Sequence ShortSequence() {
  Sequence sequence;
  sequence.camera = GroundCamera::Pinhole(64, 48, 53.0, 0.5, 0.4);
  for (int i = 0; i < 6; ++i) {
    SequenceFrame frame;
    frame.utime = 100'000 * i;
    frame.map_from_robot = Pose2{0.1 * i, 0.0, 0.02 * i};
    sequence.frames.push_back(frame);
  }
  return sequence;
}

GroundFrame FrameWithMotion(MotionStatus status, Utime from, const Pose2& motion) {
  GroundFrame frame;
  frame.labels = cv::Mat(48, 64, CV_8UC1, cv::Scalar(kGround));
  frame.motion.status = status;
  frame.motion.from_to = motion;
  frame.motion_from = from;
  return frame;
}

Pose2 TrueMotion(const Sequence& sequence, std::size_t from, std::size_t to) {
  return sequence.frames[from].map_from_robot->Inverse() * *sequence.frames[to].map_from_robot;
}

TEST(GroundScorer, MeasuresMotionAndForgivesWhatALaterFrameMakesUpFor) {
  const Sequence sequence = ShortSequence();
  GroundScorer exact(sequence, 6.0);
  exact.Add(3, FrameWithMotion(MotionStatus::kOk, 200'000, TrueMotion(sequence, 2, 3)), {}, 0.0);
  exact.Add(4, FrameWithMotion(MotionStatus::kTooFewFeatures, 300'000, {}), {}, 0.0);
  exact.Add(5, FrameWithMotion(MotionStatus::kOk, 300'000, TrueMotion(sequence, 3, 5)), {}, 0.0);
  EXPECT_NEAR(exact.Result().values.at("translation_error"), 0.0, 1e-9);
  EXPECT_NEAR(exact.Result().values.at("rotation_error"), 0.0, 1e-9);

  GroundScorer silent(sequence, 6.0);
  silent.Add(3, FrameWithMotion(MotionStatus::kOk, 200'000, TrueMotion(sequence, 2, 3)), {}, 0.0);
  silent.Add(4, FrameWithMotion(MotionStatus::kTooFewFeatures, 300'000, {}), {}, 0.0);
  EXPECT_NEAR(silent.Result().values.at("translation_error"), 0.5, 1e-9);
  EXPECT_NEAR(silent.Result().values.at("rotation_error"), 0.5, 1e-9);
}

TEST(GroundScorer, DoesNotJudgeTheFirstFrames) {
  const Sequence sequence = ShortSequence();
  GroundScorer scorer(sequence, 6.0);
  const cv::Mat truth(48, 64, CV_8UC1, cv::Scalar(2));
  for (std::size_t i = 0; i < 4; ++i) {
    scorer.Add(i, FrameWithMotion(MotionStatus::kRestart, 0, {}), truth, 0.0);
  }
  EXPECT_EQ(scorer.Result().frames, 1U);
  EXPECT_DOUBLE_EQ(scorer.Result().values.at("region_false_rate_mean"), 1.0);
}

TEST(EvaluateGround, NamesTheFileThatIsWrong) {
  const testing::TempDir folder;
  const auto no_sequence = testing::RunToEnd("evaluate_ground", {folder.path().string()});
  EXPECT_EQ(no_sequence.exit_code, 2);
  EXPECT_NE(no_sequence.output.find("sequence.toml"), std::string::npos) << no_sequence.output;
}

TEST(EvaluateGround, NamesTheFrameThatIsWrong) {
  const testing::TempDir folder;
  std::filesystem::create_directory(folder.path() / "frames");
  folder.Write("sequence.toml", "name = \"test\"\nrate_hz = 10.0\n" +
                                    GroundCamera::Pinhole(160, 120, 130.0, 0.5, 0.4).Toml());
  const auto write = [&](const char* name, int width, int height, std::size_t bytes) {
    auto jpeg = EncodeJpeg(cv::Mat(height, width, CV_8UC3, cv::Scalar()), 90);
    jpeg.resize(std::min(bytes, jpeg.size()));
    folder.Write(name, {jpeg.begin(), jpeg.end()});
  };
  const auto run = [&] {
    return testing::RunToEnd("evaluate_ground", {folder.path().string(), "--json"});
  };
  for (int i = 0; i < 5; ++i) {
    write(("frames/00000" + std::to_string(i) + ".jpg").c_str(), 160, 120, 100'000);
  }
  // Black frames are no error: nothing is known in them.
  const auto black = run();
  ASSERT_EQ(black.exit_code, 0) << black.output;
  EXPECT_EQ(nlohmann::json::parse(black.output).at("frames"), 2);

  write("frames/000003.jpg", 160, 120, 400);
  const auto cut = run();
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_NE(cut.output.find("000003.jpg"), std::string::npos) << cut.output;
  write("frames/000003.jpg", 3840, 2160, 10'000'000);
  const auto large = run();
  EXPECT_EQ(large.exit_code, 2);
  EXPECT_NE(large.output.find("000003.jpg: frame refused: 3840 x 2160"), std::string::npos)
      << large.output;
}

TEST(EvaluateGround, FindsTheGroundOfARecordedSequence) {
  if (testing::SharedData().empty()) GTEST_SKIP() << testing::kNoSharedData;
  const auto folder = testing::SharedData() / "sequences" / "dev_office";
  const auto finished = testing::RunToEnd("evaluate_ground", {folder.string(), "--json"});
  ASSERT_EQ(finished.exit_code, 0) << finished.output;
  const auto scores = nlohmann::json::parse(finished.output);
  EXPECT_EQ(scores.at("sequence"), "dev_office");
  EXPECT_EQ(scores.at("frames"), 37);
  EXPECT_LT(scores.at("region_false_rate_mean"), 0.02);
  EXPECT_LT(scores.at("obstacle_as_ground"), 0.01);
  EXPECT_GT(scores.at("ground_recall"), 0.97);
  EXPECT_LT(scores.at("range_error_median"), 0.01);
  EXPECT_LT(scores.at("translation_error"), 0.01);
  EXPECT_LT(scores.at("rotation_error"), 0.02);
  for (const char* key :
       {"region_false_rate_max", "undetermined", "feature_false_rate_mean", "range_error_mean",
        "range_error_p95", "range_error_bias", "missed", "phantom", "ms_median", "ms_p95"}) {
    EXPECT_TRUE(scores.contains(key)) << key;
  }
}

}  // namespace
}  // namespace beckon
