// Scores against closed forms, the program on bad input, and the real places.
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/process.hpp"
#include "tests/support/support.hpp"
#include "tools/evaluation/localization/evaluate.hpp"
#include "tools/evaluation/localization/report.hpp"

namespace beckon {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::RunToEnd;
using testing::SharedData;

TEST(ErrorSummary, IsAsDefined) {
  std::vector<double> errors;
  for (int i = 100; i >= 0; --i) errors.push_back(0.1 * i);
  const ErrorSummary summary = SummariseErrors(errors);
  EXPECT_NEAR(summary.mean, 5.0, 1e-9);
  EXPECT_NEAR(summary.median, 5.0, 1e-9);
  EXPECT_NEAR(summary.p95, 9.5, 1e-9);
  EXPECT_NEAR(summary.max, 10.0, 1e-9);
  EXPECT_NEAR(summary.sd, 0.1 * std::sqrt((101.0 * 101.0 - 1.0) / 12.0), 1e-9);
  EXPECT_EQ(SummariseErrors({2.0}).p95, 2.0);
  EXPECT_THROW(SummariseErrors({}), std::invalid_argument);
}

TEST(ThesisTable, ShowsItsPlacesBesideItsFigures) {
  SiteEvaluation evaluation;
  evaluation.site = "EE2";
  const auto errors = [](double error_m) {
    MethodErrors method;
    method.error_m = {error_m, error_m};
    method.ms = {0.0, 0.0};
    return method;
  };
  evaluation.methods = {{"min_max", errors(2.5)}, {"map_filtered", errors(0.5)}};
  EXPECT_THAT(Table(evaluation), Not(HasSubstr("thesis"))) << "a real place of that name";
  evaluation.methods.emplace_back("oracle", errors(0.4));
  EXPECT_THAT(Table(evaluation),
              AllOf(HasSubstr("Table 2-3 of the thesis, EE2"),
                    ContainsRegex("map_filtered +0.50 +0.00 +0.20 +1.21 +0.49\n"),
                    ContainsRegex("oracle +0.40 +0.00 +0.16 +- +-\n")));
  evaluation.site = "hall";
  EXPECT_THAT(Table(evaluation), Not(HasSubstr("thesis")));
  EXPECT_EQ(Merge({evaluation, evaluation}).site, "hall");
}

// A room with a beacon in each corner; a tag that stands in the middle.
class MadeUpSite : public ::testing::Test {
 protected:
  MadeUpSite() {
    folder_.Write("site.toml",
                  "name = \"room\"\n[area]\nmin = [0.0, 0.0]\nmax = [8.0, 8.0]\n"
                  "[tag]\nheight_m = 1.0\n[evaluation]\nwindow_s = 1.0\n"
                  "[[beacons]]\nid = \"a\"\nposition = [0.0, 0.0, 1.0]\n"
                  "[[beacons]]\nid = \"b\"\nposition = [8.0, 0.0, 1.0]\n"
                  "[[beacons]]\nid = \"c\"\nposition = [8.0, 8.0, 1.0]\n"
                  "[[beacons]]\nid = \"d\"\nposition = [0.0, 8.0, 1.0]\n");
    std::string calibration = "utime,tag,beacon,rssi_dbm,x_m,y_m\n";
    for (int i = 0; i < 49; ++i) {
      const double x = 1.0 + i % 7;
      const double y = 1.0 + i / 7;
      const double corners[4][2] = {{0, 0}, {8, 0}, {8, 8}, {0, 8}};
      for (int b = 0; b < 4; ++b) {
        const double distance = std::hypot(x - corners[b][0], y - corners[b][1]);
        calibration += std::to_string(i * 2'000'000) + ",walk," + std::string(1, "abcd"[b]) + "," +
                       std::to_string(-50.0 - 25.0 * std::log10(distance)) + "," +
                       std::to_string(x) + "," + std::to_string(y) + "\n";
      }
    }
    folder_.Write("calibration.csv", calibration);
    // At 5 s all four are heard alike; at 9 s nothing is; the reading at 20 s belongs to nobody's
    // window.
    folder_.Write("readings.csv",
                  "utime,tag,beacon,rssi_dbm\n4500000,t,a,-68.8\n4600000,t,b,-68.8\n"
                  "4700000,t,c,-68.8\n5000000,t,d,-68.8\n4000000,t,a,-50\n20000000,t,a,-50\n");
    folder_.Write("truth.csv", "utime,tag,x_m,y_m\n5000000,t,4.0,4.0\n9000000,t,4.0,1.0\n");
  }
  testing::Finished Run(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {folder_.path().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunToEnd("evaluate_localization", arguments);
  }
  testing::TempDir folder_;
};

TEST_F(MadeUpSite, EpochsGetTheReadingsOfTheirWindowAndNoOthers) {
  const SiteEvaluation evaluation = EvaluateSite(folder_.path(), {});
  EXPECT_EQ(evaluation.site, "room");
  EXPECT_EQ(evaluation.epochs, 2);
  EXPECT_EQ(evaluation.silent_epochs, 1);
  std::vector<std::string> names;
  for (const auto& [name, errors] : evaluation.methods) {
    names.push_back(name);
    ASSERT_EQ(errors.error_m.size(), 2U) << name;
    // Heard alike by all corners: the middle, for every method. A reading of before the window or
    // after the epoch would draw it into a corner.
    // Tracking may use what was heard before, and is drawn a little.
    EXPECT_LT(errors.error_m[0], name == "tracking" ? 1.0 : 0.4) << name;
    EXPECT_NEAR(errors.error_m[1], 3.0, name == "tracking" ? 1.0 : 0.4)
        << name << ": nothing heard is the middle of the room";
    EXPECT_EQ(errors.ms.size(), 2U);
  }
  EXPECT_THAT(names,
              ::testing::ElementsAre("area_centre", "weighted_centroid", "min_max", "rocrssi",
                                     "cc2431", "map_2d", "map_filtered", "tracking"));
}

TEST_F(MadeUpSite, JsonHasTheKeysOfTheFormat) {
  const testing::Finished run = Run({"--json"});
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const json result = json::parse(run.output);
  EXPECT_EQ(result.at("site"), "room");
  EXPECT_EQ(result.at("epochs"), 2);
  for (const auto& [name, method] : result.at("methods").items()) {
    for (const char* key : {"mean", "median", "p95", "max", "sd", "ms"}) {
      EXPECT_TRUE(method.at(key).is_number()) << name << "." << key;
    }
    EXPECT_NEAR(method.at("mean").get<double>(), 1.5, 0.4) << name;
  }
  for (const char* name : {"map_2d", "map_filtered", "tracking"}) {
    EXPECT_TRUE(result.at("methods").at(name).contains("coverage_90")) << name;
  }
}

TEST_F(MadeUpSite, SeveralSitesAreShownOneByOneAndTogether) {
  const testing::Finished tables = Run({folder_.path().string()});
  EXPECT_EQ(tables.exit_code, 0);
  EXPECT_THAT(tables.output, AllOf(HasSubstr("room: 2 epochs"), HasSubstr("all sites: 4 epochs")));
  const json both = json::parse(Run({folder_.path().string(), "--json"}).output);
  EXPECT_EQ(both.at("sites").size(), 2U);
  EXPECT_EQ(both.at("all").at("epochs"), 4);
  EXPECT_NEAR(both.at("all").at("methods").at("min_max").at("mean").get<double>(),
              both.at("sites").at(0).at("methods").at("min_max").at("mean").get<double>(), 1e-9);
}

TEST_F(MadeUpSite, BadFilesAreNamedWithTheirLine) {
  // Later files are read first, so that each fault is met before the ones already made.
  const auto refused = [&](const std::string& name, const std::string& text,
                           const std::string& where) {
    folder_.Write(name, text);
    const testing::Finished run = Run();
    EXPECT_EQ(run.exit_code, 2) << where;
    EXPECT_THAT(run.output, HasSubstr(where));
  };
  refused("truth.csv", "utime,tag,x_m,y_m\n", "truth.csv");
  refused("truth.csv", "utime,tag,x_m,y_m\n1,t,nan,1.0\n", "truth.csv:2");
  refused("readings.csv", "utime,tag,beacon,rssi_dbm\n1,t,a,-60\n2,t,nobody,-60\n",
          "readings.csv:3");
  refused("readings.csv", "utime,tag,beacon,rssi_dbm\n1,t,a,nan\n", "readings.csv:2");
  refused("calibration.csv", "utime,tag,beacon,rssi_dbm,x_m,y_m\n1,t,a,-60,1.0\n",
          "calibration.csv:2");
  refused("calibration.csv", "utime,tag,beacon\n", "calibration.csv:1");
  refused("site.toml", "name = \"room\"\n[area]\nmin = [0.0, 0.0]\n", "site.toml");
  EXPECT_EQ(RunToEnd("evaluate_localization", {"/nowhere"}).exit_code, 2);
  EXPECT_EQ(RunToEnd("evaluate_localization", {}).exit_code, 2);
}

TEST_F(MadeUpSite, NoCalibrationAtAllIsStatedBehaviour) {
  folder_.Write("calibration.csv", "utime,tag,beacon,rssi_dbm,x_m,y_m\n");
  const SiteEvaluation evaluation = EvaluateSite(folder_.path(), {});
  EXPECT_THAT(evaluation.model, HasSubstr("not calibrated"));
  for (const auto& [name, errors] : evaluation.methods) {
    // Tracking has heard one corner before, and louder.
    EXPECT_LT(errors.error_m[0], name == "tracking" ? 2.0 : 1.0) << name;
  }
}

struct Scores {
  double mean;
  double p95;
};
std::map<std::string, Scores> ScoresOf(const SiteEvaluation& evaluation) {
  std::map<std::string, Scores> scores;
  for (const auto& [name, errors] : evaluation.methods) {
    const ErrorSummary summary = SummariseErrors(errors.error_m);
    scores[name] = {summary.mean, summary.p95};
  }
  return scores;
}
double Coverage(const SiteEvaluation& evaluation, const std::string& method) {
  for (const auto& [name, errors] : evaluation.methods) {
    if (name != method) continue;
    return static_cast<double>(std::count(errors.inside_90.begin(), errors.inside_90.end(), 1)) /
           static_cast<double>(errors.inside_90.size());
  }
  return 0.0;
}
constexpr const char* kRivals[] = {"area_centre", "weighted_centroid", "min_max", "rocrssi",
                                   "cc2431"};

class RealPlace : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(RealPlaces, RealPlace,
                         ::testing::Values("flat_ble", "office_ble", "office2_ble"));

TEST_P(RealPlace, EveryRivalIsBeatenAndTheAreaHoldsNinetyPercent) {
  if (SharedData().empty()) GTEST_SKIP() << testing::kNoSharedData;
  const SiteEvaluation evaluation = EvaluateSite(SharedData() / "rssi" / GetParam(), {});
  const std::map<std::string, Scores> scores = ScoresOf(evaluation);
  for (const char* ours : {"map_filtered", "tracking"}) {
    for (const char* rival : kRivals) {
      // In office2_ble the weighted centroid under its grid of beacons at the ceiling is as good.
      EXPECT_LT(scores.at(ours).mean, 1.01 * scores.at(rival).mean) << ours << " against " << rival;
      EXPECT_LT(scores.at(ours).p95, scores.at(rival).p95) << ours << " against " << rival;
    }
    EXPECT_GE(Coverage(evaluation, ours), 0.85) << ours;
    EXPECT_LE(Coverage(evaluation, ours), 0.96) << ours;
  }
}

TEST(RealPlaces, FlatToTheMetre) {
  if (SharedData().empty()) GTEST_SKIP() << testing::kNoSharedData;
  const auto scores = ScoresOf(EvaluateSite(SharedData() / "rssi" / "flat_ble", {}));
  EXPECT_LT(scores.at("map_filtered").mean, 1.35);
  EXPECT_LT(scores.at("tracking").mean, 1.15);
}

TEST(RealPlaces, HouseWithOneNodeLeftOut) {
  if (SharedData().empty()) GTEST_SKIP() << testing::kNoSharedData;
  std::vector<SiteEvaluation> folders;
  for (const char* node : {"node1", "node2", "node5", "node6", "node7"}) {
    folders.push_back(EvaluateSite(SharedData() / "rssi" / "house_zigbee" / node, {}));
  }
  const std::map<std::string, Scores> scores = ScoresOf(Merge(folders));
  for (const char* rival : kRivals) {
    EXPECT_LT(scores.at("map_filtered").mean, scores.at(rival).mean) << rival;
    EXPECT_LT(scores.at("tracking").mean, scores.at(rival).mean) << rival;
  }
}

}  // namespace
}  // namespace beckon
