// The experiments of the thesis: their sums, and that they run.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/support/process.hpp"
#include "tools/evaluation/thesis/range_experiment.hpp"
#include "tools/evaluation/thesis/robot_eye.hpp"
#include "tools/simulation/folders.hpp"

namespace beckon {
namespace {

using nlohmann::json;

TEST(WallsSummary, MeansOverTrialsAndTheWorstFrameOfAll) {
  std::vector<GroundScores> trials(2);
  trials[0].values = {{"region_false_rate_mean", 0.01},
                      {"region_false_rate_max", 0.07},
                      {"feature_false_rate_mean", 0.02}};
  // No feature was matched in the second trial: it says nothing about them.
  trials[1].values = {{"region_false_rate_mean", 0.03}, {"region_false_rate_max", 0.04}};
  const WallsSummary summary = SummariseWalls(trials);
  EXPECT_DOUBLE_EQ(summary.region_false_rate, 0.02);
  EXPECT_DOUBLE_EQ(summary.region_false_rate_worst, 0.07);
  EXPECT_DOUBLE_EQ(summary.feature_false_rate, 0.02);
}

TEST(RangeTable, MeanOverTheDistancesAskedFor) {
  RangeTable table;
  for (int i = 0; i < 3; ++i) {
    RangeRow row;
    row.distance_m = 1.6 + 0.4 * i;
    row.error = 0.01 * (i + 1);
    table.rows.push_back(row);
  }
  EXPECT_NEAR(table.MeanError(1.6, 2.0), 0.015, 1e-12);
  EXPECT_NEAR(table.MeanError(2.4, 9.0), 0.03, 1e-12);
}

// Brightness and its spread over the true floor and over the rest.
TEST(WallsScene, ColourSaysNothingAboutWhatIsFloor) {
  simulation::Random random(7, simulation::Stream::kLayout);
  const simulation::World world = BareRoom(7, {0.0, -2.0}, {6.0, 2.0}, /*open_back=*/true);
  const auto difference = [&](const std::optional<simulation::Look>& look) {
    simulation::RenderOptions options;
    options.texel_m = 0.005;
    options.one_look = look;
    RobotEye eye(world, simulation::DefaultCamera().Resized(320, 240), options);
    const View view = eye.Look({3.5, 0.0, 0.2});
    cv::Scalar floor_mean, wall_mean, floor_sd, wall_sd;
    cv::meanStdDev(view.bgr, floor_mean, floor_sd, view.truth == kGround);
    cv::meanStdDev(view.bgr, wall_mean, wall_sd, view.truth == kNotGround);
    return cv::norm(floor_mean - wall_mean) / cv::norm(floor_sd);
  };
  EXPECT_LT(difference(simulation::RandomMottle(random)), 0.2);
  EXPECT_GT(difference(std::nullopt), 1.0) << "a room as it is gives the floor away";
}

TEST(EvaluateThesis, RepeatsTheWalls) {
  const testing::TempDir folder;
  const auto finished =
      testing::RunToEnd("evaluate_thesis",
                        {"walls", "--trials", "1", "--json", "--pictures", folder.path().string()});
  ASSERT_EQ(finished.exit_code, 0) << finished.output;
  const json result = json::parse(finished.output);
  EXPECT_EQ(result.at("trials"), 1);
  EXPECT_EQ(result.at("each").size(), 1U);
  EXPECT_LT(result.at("region_false_rate_mean"), 0.04);
  EXPECT_LT(result.at("feature_false_rate_mean"), 0.04);
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "walls_1.jpg"));
}

// Of a room whose boards run along the way: their joints hardly show how far the robot has come.
TEST(EvaluateThesis, RepeatsTheTableOfRanges) {
  const auto finished =
      testing::RunToEnd("evaluate_thesis", {"range", "--trials", "1", "--seed", "5", "--json"});
  ASSERT_EQ(finished.exit_code, 0) << finished.output;
  const json result = json::parse(finished.output);
  for (const char* scale : {"full", "tenth"}) {
    EXPECT_EQ(result.at(scale).at("rows").size(), 12U);
    EXPECT_NEAR(result.at(scale).at("rows").at(0).at("distance_m"), 1.6, 1e-9);
    EXPECT_NEAR(result.at(scale).at("rows").at(11).at("distance_m"), 6.0, 1e-9);
  }
  EXPECT_LT(result.at("full").at("error_1.6_to_4.8_m"), 0.03);
  EXPECT_LT(result.at("full").at("error_5.2_to_6.0_m"), 0.03);
}

TEST(EvaluateThesis, KnowsItsArguments) {
  for (const std::vector<std::string>& bad :
       {std::vector<std::string>{}, {"corridor"}, {"walls", "--trials", "0"}}) {
    EXPECT_EQ(testing::RunToEnd("evaluate_thesis", bad).exit_code, 2);
  }
}

}  // namespace
}  // namespace beckon
