// evaluate_pose: one drive end to end, and its command line.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/support/process.hpp"
#include "tools/evaluation/pose/report.hpp"

namespace beckon {
namespace {

using ::testing::HasSubstr;

// Without people who might stand in its way, so that it is short (see ScenarioWorld).
constexpr std::uint64_t kSeed = 4;

TEST(EvaluatePose, TheRobotFindsItselfAtTheStartAndWhenItWasCarriedAway) {
  PoseDriveOptions options;
  options.find_m = 6.0;
  options.track_m = 1.0;
  options.is_carried = true;
  options.recover_m = 8.0;
  const PoseDrive drive = RunPoseDrive(kSeed, options);
  for (const Search& search : {drive.start, drive.recovery}) {
    EXPECT_TRUE(search.is_right);
    EXPECT_LT(search.error_m, kRightM);
    EXPECT_GT(search.found_s, 0.0) << "it was not told where it is";
    EXPECT_LE(search.found_m, search.driven_m);
  }
  EXPECT_GE(drive.start.driven_m, options.find_m);
  EXPECT_GE(drive.recovery.driven_m, options.recover_m);
  // Until it is noticed that the robot was carried away.
  EXPECT_GT(drive.wrong_s, 0.0);
  EXPECT_LT(drive.wrong_s, drive.located_s);
  EXPECT_FALSE(drive.errors_m.empty());

  const auto json = nlohmann::json::parse(DrivesAsJson({drive}, options));
  EXPECT_EQ(json["start"]["right"], 1);
  EXPECT_EQ(json["recovery"]["right"], 1);
  EXPECT_EQ(json["runs"][0]["seed"], kSeed);
  EXPECT_THAT(DrivesAsTable({drive}, options), HasSubstr("1 of 1 right after 6 m, 0 off"));
}

TEST(EvaluatePose, RefusesSeedsThatAreNone) {
  for (const char* seeds : {"5-1", "a", "1-2x", "-3", "1--3"}) {
    const testing::Finished run =
        testing::RunToEnd("evaluate_pose", {std::string("--seeds=") + seeds});
    EXPECT_EQ(run.exit_code, 2) << seeds;
    EXPECT_THAT(run.output, HasSubstr("--seeds"));
  }
  EXPECT_EQ(testing::RunToEnd("evaluate_pose", {"--help"}).exit_code, 0);
}

}  // namespace
}  // namespace beckon
