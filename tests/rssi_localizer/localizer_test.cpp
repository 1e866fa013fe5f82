#include "services/rssi_localizer/localizer.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/rssi_localizer/example_site.hpp"

namespace beckon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ExampleCalibration;
using testing::ExamplePathLoss;
using testing::ExampleSite;
using Status = TagLocation::Status;
using Verdict = Localizer::Verdict;

LocalizerOptions FewTags() {
  LocalizerOptions options;
  options.model = MeasurementModelKind::kLogNormal;  // the readings follow it
  options.max_tags = 3;
  return options;
}

class LocalizerTest : public ::testing::Test {
 protected:
  Verdict Add(const std::string& tag, const std::string& beacon, double rssi, Utime utime) {
    return localizer_.Add({utime, tag, beacon, rssi}, clock_.Now());
  }
  // What a tag at this place hears now, without noise.
  void Hear(const std::string& tag, const Eigen::Vector2d& place) {
    for (std::size_t b = 0; b < site_.beacons.size(); ++b) {
      const double distance = BeaconDistance(site_.beacons[b], site_.tag_height_m, place);
      EXPECT_EQ(
          Add(tag, site_.beacons[b].id, ExamplePathLoss().MeanRssi(distance), clock_.Now().utime),
          Verdict::kAccepted);
    }
  }

  ManualClock clock_;
  Site site_ = ExampleSite();
  Localizer localizer_{
      SiteModel::Fit(site_, ExampleCalibration(site_, ExamplePathLoss(), 300, 4.0), FewTags()),
      FewTags()};
};

TEST_F(LocalizerTest, LocatesEveryTagThatIsHeard) {
  EXPECT_TRUE(localizer_.Update(clock_.Now()).empty());
  Hear("one", {2.0, 3.0});
  Hear("two", {8.0, 6.0});
  const auto locations = localizer_.Update(clock_.Now());
  ASSERT_EQ(locations.size(), 2U);
  EXPECT_EQ(locations[0].tag, "one");
  EXPECT_EQ(locations[0].status, Status::kOk);
  EXPECT_EQ(locations[0].utime, clock_.Now().utime);
  EXPECT_EQ(locations[0].beacons, 5);
  EXPECT_EQ(locations[0].readings, 5);
  EXPECT_LT((locations[0].estimate.mean - Eigen::Vector2d(2.0, 3.0)).norm(), 1.0);
  EXPECT_LT((locations[1].estimate.mean - Eigen::Vector2d(8.0, 6.0)).norm(), 1.0);
  EXPECT_GT(locations[0].estimate.area_90_m2, 1.0);
}

TEST_F(LocalizerTest, FollowsATagThatWalksAndSettlesOnOneThatStands) {
  for (int i = 0; i <= 20; ++i) {
    Hear("tag", {1.0 + 0.4 * i, 4.0});
    localizer_.Update(clock_.Now());
    clock_.Advance(milliseconds(500));
  }
  Eigen::Vector2d last = localizer_.Update(clock_.Now()).front().estimate.mean;
  double path = 0.0;
  for (int i = 0; i < 40; ++i) {
    Hear("tag", {9.0, 4.0});
    const Eigen::Vector2d mean = localizer_.Update(clock_.Now()).front().estimate.mean;
    if (i >= 20) path += (mean - last).norm();
    last = mean;
    clock_.Advance(milliseconds(500));
  }
  EXPECT_LT((last - Eigen::Vector2d(9.0, 4.0)).norm(), 1.0);
  EXPECT_LT(path, 0.1) << "what stands still has to look still";
}

TEST_F(LocalizerTest, TheOrderOfArrivalDoesNotMatter) {
  const Utime now = clock_.Now().utime;
  Localizer other(
      SiteModel::Fit(site_, ExampleCalibration(site_, ExamplePathLoss(), 300, 4.0), FewTags()),
      FewTags());
  std::vector<Reading> readings;
  for (int i = 0; i < 8; ++i) {
    readings.push_back(
        {now - 100'000 * i, "tag", site_.beacons[static_cast<std::size_t>(i % 5)].id, -60.0 - i});
  }
  for (const Reading& reading : readings) localizer_.Add(reading, clock_.Now());
  std::reverse(readings.begin(), readings.end());
  for (const Reading& reading : readings) other.Add(reading, clock_.Now());
  const Estimate a = localizer_.Update(clock_.Now()).front().estimate;
  const Estimate b = other.Update(clock_.Now()).front().estimate;
  EXPECT_LT((a.mean - b.mean).norm(), 1e-4);
}

TEST_F(LocalizerTest, RefusesWhatItCannotUse) {
  const Utime now = clock_.Now().utime;
  EXPECT_EQ(Add("tag", "nobody", -60.0, now), Verdict::kUndeclaredBeacon);
  EXPECT_EQ(Add("tag", "a", std::nan(""), now), Verdict::kImplausible);
  EXPECT_EQ(Add("tag", "a", 80.0, now), Verdict::kImplausible);
  EXPECT_EQ(Add("", "a", -60.0, now), Verdict::kImplausible);
  EXPECT_EQ(Add("tag", "a", -60.0, std::numeric_limits<Utime>::min()), Verdict::kImplausible);
  EXPECT_EQ(Add("tag", "a", -60.0, now + 2'000'000), Verdict::kFuture);
  EXPECT_EQ(localizer_.tags(), 0U) << "none of these makes a tag known";
  EXPECT_EQ(Add("tag", "a", -60.0, now), Verdict::kAccepted);
  EXPECT_EQ(Add("tag", "a", -60.0, now - 900'000), Verdict::kAccepted) << "within the window";
  EXPECT_EQ(Add("tag", "a", -60.0, now - 1'100'000), Verdict::kLate);
}

TEST_F(LocalizerTest, SilentTagsAreSaidToBeSilentAndThenForgotten) {
  Hear("tag", {2.0, 3.0});
  const double area = localizer_.Update(clock_.Now()).front().estimate.area_90_m2;
  clock_.Advance(seconds(4));
  EXPECT_EQ(localizer_.Update(clock_.Now()).front().status, Status::kOk);
  clock_.Advance(seconds(2));
  const auto silent = localizer_.Update(clock_.Now());
  EXPECT_EQ(silent.front().status, Status::kSilent);
  EXPECT_GT(silent.front().estimate.area_90_m2, 1.3 * area) << "it may have walked on";
  Hear("tag", {2.0, 3.0});
  EXPECT_EQ(localizer_.Update(clock_.Now()).front().status, Status::kOk);
  clock_.Advance(seconds(61));
  EXPECT_TRUE(localizer_.Update(clock_.Now()).empty());
  EXPECT_EQ(localizer_.tags(), 0U);
}

TEST_F(LocalizerTest, TagsAreBoundedInNumber) {
  for (const char* tag : {"1", "2", "3"}) Hear(tag, {1.0, 1.0});
  EXPECT_EQ(Add("4", "a", -60.0, clock_.Now().utime), Verdict::kTooManyTags);
  clock_.Advance(seconds(61));
  localizer_.Update(clock_.Now());
  EXPECT_EQ(Add("4", "a", -60.0, clock_.Now().utime), Verdict::kAccepted);
}

TEST_F(LocalizerTest, AFloodOfOneTagIsThinned) {
  for (int i = 0; i < 100'000; ++i) Add("tag", "a", -60.0, clock_.Now().utime);
  EXPECT_EQ(localizer_.Update(clock_.Now()).front().readings, 1000);
}

TEST_F(LocalizerTest, RecordedReadingsOfLongAgoWork) {
  const Utime long_ago = 1'000'000;
  for (int i = 0; i < 5; ++i) {
    Add("tag", site_.beacons[static_cast<std::size_t>(i)].id, -60.0, long_ago);
  }
  EXPECT_EQ(localizer_.Update(clock_.Now()).front().status, Status::kOk);
  EXPECT_EQ(localizer_.Update(clock_.Now()).front().utime, long_ago);
}

TEST_F(LocalizerTest, AfterAStepBackOfTheWallClockTagsAreFoundAgain) {
  Hear("tag", {2.0, 3.0});
  localizer_.Update(clock_.Now());
  clock_.StepWallClock(-std::chrono::hours(1));
  EXPECT_EQ(Add("tag", "a", -60.0, clock_.Now().utime), Verdict::kLate);
  clock_.Advance(seconds(61));
  localizer_.Update(clock_.Now());
  EXPECT_EQ(Add("tag", "a", -60.0, clock_.Now().utime), Verdict::kAccepted);
}

TEST_F(LocalizerTest, ReadingsThatNoPlaceExplainsAreOutside) {
  // As strong as at one metre from all four corners at once.
  for (const Beacon& beacon : site_.beacons) Add("tag", beacon.id, -20.0, clock_.Now().utime);
  EXPECT_EQ(localizer_.Update(clock_.Now()).front().status, Status::kOutside);
}

TEST_F(LocalizerTest, OneBeaconIsEnoughForARing) {
  Add("tag", "a", ExamplePathLoss().MeanRssi(3.0), clock_.Now().utime);
  const TagLocation location = localizer_.Update(clock_.Now()).front();
  EXPECT_EQ(location.status, Status::kOk);
  EXPECT_EQ(location.beacons, 1);
  EXPECT_GT(location.estimate.area_90_m2, 10.0);
}

TEST(Localizer, WorksWithoutCalibration) {
  const Site site = ExampleSite();
  LocalizerOptions options;
  options.prior = ExamplePathLoss();
  ManualClock clock;
  Localizer localizer(SiteModel::Fit(site, {}, options), options);
  EXPECT_THAT(localizer.model().description, ::testing::HasSubstr("not calibrated"));
  const Eigen::Vector2d place(7.0, 2.0);
  for (const Beacon& beacon : site.beacons) {
    localizer.Add({clock.Now().utime, "tag", beacon.id,
                   options.prior.MeanRssi(BeaconDistance(beacon, site.tag_height_m, place))},
                  clock.Now());
  }
  EXPECT_LT((localizer.Update(clock.Now()).front().estimate.mean - place).norm(), 1.5);
}

TEST(Localizer, WithoutTrackingEachWindowStandsAlone) {
  const Site site = ExampleSite();
  LocalizerOptions options;
  options.tracking = false;
  options.prior = ExamplePathLoss();
  ManualClock clock;
  Localizer localizer(SiteModel::Fit(site, {}, options), options);
  localizer.Add({clock.Now().utime, "tag", "a", -50.0}, clock.Now());
  const Eigen::Vector2d near_a = localizer.Update(clock.Now()).front().estimate.mean;
  clock.Advance(seconds(2));
  localizer.Add({clock.Now().utime, "tag", "c", -50.0}, clock.Now());
  const Eigen::Vector2d near_c = localizer.Update(clock.Now()).front().estimate.mean;
  EXPECT_LT((near_a + near_c - Eigen::Vector2d(10.0, 8.0)).norm(), 1e-3) << "mirror images";
  EXPECT_LT(near_a.norm(), 4.5);
}

}  // namespace
}  // namespace beckon
