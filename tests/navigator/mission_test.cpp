// Missions in simulated flats, and the program that runs them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <tuple>

#include "tests/support/process.hpp"
#include "tools/evaluation/navigation/mission.hpp"
#include "tools/simulation/solids.hpp"

namespace beckon {
namespace {

TEST(Mission, SameSeedIsTheSameRun) {
  MissionOptions options = DefaultMissionOptions();
  options.use_true_pose = true;
  const Mission first = RunMission(1, options);
  const Mission again = RunMission(1, options);
  EXPECT_EQ(first.outcome, "arrived") << first.reason;
  EXPECT_LE(first.final_distance_m, 2.0);
  EXPECT_GT(first.closest_m, 0.0);
  EXPECT_EQ(first.time_s, again.time_s);
  EXPECT_EQ(first.path_m, again.path_m);
  EXPECT_EQ(first.final_distance_m, again.final_distance_m);
}

class Scenarios : public ::testing::TestWithParam<std::tuple<Scenario, int>> {};

// evaluate_navigation runs a hundred of each.
TEST_P(Scenarios, ArrivesWithoutATouch) {
  const auto [scenario, seed] = GetParam();
  const Mission mission =
      RunMission(static_cast<std::uint64_t>(seed), DefaultMissionOptions(scenario));
  EXPECT_EQ(mission.outcome, "arrived") << mission.reason;
  EXPECT_GT(mission.closest_m, 0.0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Scenarios,
                         ::testing::Combine(::testing::Values(Scenario::kDoor, Scenario::kStepIn,
                                                              Scenario::kStepInStanding),
                                            ::testing::Values(1, 2)));

// He comes while the robot stands, near enough to be touched, and does not walk into it himself.
TEST(Visitor, StepsUpToTheStandingRobot) {
  constexpr double kRadiusM = 0.25;
  const Eigen::Vector2d robot(7.0, 2.0);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Visitor visitor(Scenario::kStepInStanding, seed, kRadiusM);
    simulation::Truth truth;
    truth.map_from_robot = {7.15, 2.0, 0.0};
    truth.speed_mps = 0.3;
    EXPECT_FALSE(visitor.At(truth, robot));
    truth.speed_mps = 0.0;
    for (; truth.time_s < 3.0; truth.time_s += 0.1) {
      const auto body = visitor.At(truth, robot);
      ASSERT_TRUE(body);
      EXPECT_GT(simulation::Distance(*body, robot), kRadiusM + 0.02);
    }
    EXPECT_TRUE(visitor.has_come(truth.time_s));
    EXPECT_LT(simulation::Distance(*visitor.At(truth, robot), robot), kRadiusM + 0.61);
  }
}

TEST(Mission, OdometryErrorsCanBeMadeLarger) {
  MissionOptions options = DefaultMissionOptions(Scenario::kStepInStanding);
  const Mission usual = RunMission(1, options);
  options.odometry_error = 10.0;
  EXPECT_GT(RunMission(1, options).pose_error_m, usual.pose_error_m);
}

TEST(EvaluateNavigation, PrintsTheNamesOfTheScoring) {
  const auto finished = testing::RunToEnd("evaluate_navigation", {"--seeds", "1-2", "--json"});
  ASSERT_EQ(finished.exit_code, 0) << finished.output;
  const auto report = nlohmann::json::parse(finished.output);
  for (const char* key : {"arrived", "collided", "gave_up", "unreachable", "path_ratio_median",
                          "closest_m_min", "time_s_median", "final_distance_m_median"}) {
    EXPECT_TRUE(report[key].is_number()) << key;
  }
  EXPECT_EQ(report["missions"], 2);
  ASSERT_EQ(report["runs"].size(), 2U);
  EXPECT_EQ(report["runs"][1]["seed"], 2);
  EXPECT_TRUE(report["runs"][1]["outcome"].is_string());
}

TEST(EvaluateNavigation, BadSeedsAreNamed) {
  for (const char* seeds : {"x", "3-1", "1-", "1-2-3", ""}) {
    const auto finished = testing::RunToEnd("evaluate_navigation", {"--seeds", seeds});
    EXPECT_EQ(finished.exit_code, 2) << seeds;
    EXPECT_NE(finished.output.find("--seeds"), std::string::npos) << finished.output;
  }
}

}  // namespace
}  // namespace beckon
