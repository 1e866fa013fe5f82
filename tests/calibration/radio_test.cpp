// calibrate_rssi, on a place whose radio is known.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "common/text.hpp"
#include "tests/support/process.hpp"
#include "tools/rssi_calibration/radio_picture.hpp"
#include "tools/rssi_calibration/radio_report.hpp"

namespace beckon {
namespace {

constexpr double kRssiAt1m = -42.0;
constexpr double kExponent = 2.4;
constexpr double kSpreadDb = 3.0;
constexpr double kLoudDb = 12.0;  // what the beacon "loud" has above the others

constexpr char kSite[] =
    "name = \"hall\"\n[area]\nmin = [0.0, 0.0]\nmax = [12.0, 9.0]\n"
    "[tag]\nheight_m = 1.0\n[evaluation]\nwindow_s = 1.0\n"
    "[[beacons]]\nid = \"a\"\nposition = [0.0, 0.0, 1.0]\n"
    "[[beacons]]\nid = \"b\"\nposition = [12.0, 0.0, 1.0]\n"
    "[[beacons]]\nid = \"c\"\nposition = [0.0, 9.0, 1.0]\n"
    "[[beacons]]\nid = \"loud\"\nposition = [12.0, 9.0, 1.0]\n"
    "[[beacons]]\nid = \"off\"\nposition = [6.0, 9.0, 1.0]\n";

class CalibrateRssi : public ::testing::Test {
 protected:
  CalibrateRssi() {
    folder_.Write("site.toml", kSite);
    std::string rows = "utime,tag,beacon,rssi_dbm,x_m,y_m\n";
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0.0, kSpreadDb);
    const struct {
      const char* id;
      double x, y, extra_db;
    } beacons[] = {{"a", 0, 0, 0}, {"b", 12, 0, 0}, {"c", 0, 9, 0}, {"loud", 12, 9, kLoudDb}};
    long utime = 0;
    for (double x = 0.7; x < 12.0; x += 0.8) {
      for (double y = 0.7; y < 9.0; y += 0.8) {
        utime += 5'000'000;
        for (const auto& beacon : beacons) {
          const double distance = std::hypot(x - beacon.x, y - beacon.y);
          const double rssi =
              kRssiAt1m - 10.0 * kExponent * std::log10(distance) + beacon.extra_db + noise(random);
          rows += Format("%ld,tag,%s,%.2f,%.3f,%.3f\n", utime, beacon.id, rssi, x, y);
        }
      }
    }
    folder_.Write("calibration.csv", rows);
  }

  testing::TempDir folder_;
};

TEST_F(CalibrateRssi, FindsTheRadioThatMadeTheReadings) {
  const RadioFit fit = FitRadio(folder_.path());
  ASSERT_EQ(fit.beacons.size(), 5U);
  EXPECT_TRUE(fit.choice.parts.offsets || fit.choice.parts.residual_map);
  // No walls on this plan, so that they are not tried; one part is known to help.
  ASSERT_EQ(fit.choice.trials.size(), 6U);
  EXPECT_TRUE(fit.choice.trials[0].kept || fit.choice.trials[1].kept);
  for (const Trial& trial : fit.choice.trials) {
    EXPECT_TRUE(trial.gain > 0.0 || !trial.kept) << trial.what;
    EXPECT_TRUE(trial.kept || trial.gain < std::max(0.01, trial.standard_error)) << trial.what;
  }
  EXPECT_NEAR(fit.path_loss.exponent, kExponent, 0.25);
  // However the model shares it out between offset and residual: one is louder by so much.
  const auto level = [&](std::size_t i) {
    return fit.beacons[i].offset_db + fit.beacons[i].residuals.mean_db;
  };
  EXPECT_NEAR(level(3) - (level(0) + level(1) + level(2)) / 3.0, kLoudDb, 1.0);
  EXPECT_NEAR(fit.beacons[1].residuals.sd_db, kSpreadDb, 0.5);
  EXPECT_NEAR(fit.beacons[1].residuals.robust_sd_db, kSpreadDb, 0.6);
  EXPECT_LT(fit.beacons[1].residuals.wild_share, 0.03);
  EXPECT_EQ(fit.beacons[1].residuals.readings, 15 * 11);
  EXPECT_EQ(fit.beacons[4].residuals.readings, 0);
  EXPECT_EQ(fit.samples.size(), 4U * 15U * 11U);
}

TEST_F(CalibrateRssi, NamesTheBeaconsToLookAt) {
  const std::string table = RadioFitAsTable(FitRadio(folder_.path()));
  const std::size_t remarks = table.find("look at:");
  ASSERT_NE(remarks, std::string::npos) << table;
  EXPECT_NE(table.find("off was never heard", remarks), std::string::npos);
  EXPECT_NE(table.find("loud is +", remarks), std::string::npos);
  EXPECT_EQ(table.find("  a ", remarks), std::string::npos);
}

TEST_F(CalibrateRssi, DrawsASampleWhereItBelongs) {
  RadioFit fit = FitRadio(folder_.path());
  const cv::Mat without = DrawRadioFit(fit);
  EXPECT_EQ(without.type(), CV_8UC3);
  fit.samples.push_back({0, 3.0, -15.0});  // far below all others
  cv::Mat difference;
  cv::absdiff(DrawRadioFit(fit), without, difference);
  cv::cvtColor(difference, difference, cv::COLOR_BGR2GRAY);
  const cv::Rect changed = cv::boundingRect(difference > 0);
  EXPECT_GT(changed.area(), 8);
  EXPECT_LT(changed.area(), 100);
}

TEST_F(CalibrateRssi, ProgramPrintsJsonAndWritesThePicture) {
  const std::string picture = (folder_.path() / "fit.png").string();
  const auto run = testing::RunToEnd("calibrate_rssi",
                                     {folder_.path().string(), "--json", "--picture", picture});
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const auto json = nlohmann::json::parse(run.output);
  EXPECT_EQ(json["site"], "hall");
  EXPECT_EQ(json["beacons"].size(), 5U);
  EXPECT_TRUE(json["beacons"][4]["residuals"]["mean_db"].is_null());
  EXPECT_GT(std::filesystem::file_size(picture), 1000U);
}

TEST_F(CalibrateRssi, BadInputIsNamedAndEndsWithTwo) {
  const auto complaint = [&](const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {folder_.path().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto run = testing::RunToEnd("calibrate_rssi", arguments);
    EXPECT_EQ(run.exit_code, 2) << run.output;
    return run.output;
  };
  EXPECT_NE(complaint({"--picture", "/nowhere/fit.png"}).find("/nowhere/fit.png"),
            std::string::npos);
  const std::string header = "utime,tag,beacon,rssi_dbm,x_m,y_m\n";
  folder_.Write("calibration.csv", header);
  EXPECT_NE(complaint().find("calibration.csv: holds no readings"), std::string::npos);
  folder_.Write("calibration.csv", header + "1,tag,nobody,-50,1,1\n");
  EXPECT_NE(complaint().find("calibration.csv:2"), std::string::npos);
  folder_.Write("calibration.csv", header + "1,tag,a,-50,1,1\n1,tag,a,-50,here,1\n");
  EXPECT_NE(complaint().find("calibration.csv:3"), std::string::npos);
  folder_.Write("site.toml", "name = \"hall\"\n");
  EXPECT_NE(complaint().find("site.toml"), std::string::npos);
}

TEST(RadioFit, OneReadingIsEnoughToBeShown) {
  testing::TempDir folder;
  folder.Write("site.toml", kSite);
  folder.Write("calibration.csv", "utime,tag,beacon,rssi_dbm,x_m,y_m\n1,tag,a,-50,3,4\n");
  const RadioFit fit = FitRadio(folder.path());
  EXPECT_EQ(fit.choice.held_back_epochs, 0);
  EXPECT_EQ(fit.beacons[0].residuals.samples, 1);
  EXPECT_NEAR(fit.beacons[0].nearest_m, 5.0, 1e-9);
  EXPECT_NE(RadioFitAsTable(fit).find("a was heard in few places"), std::string::npos);
}

}  // namespace
}  // namespace beckon
