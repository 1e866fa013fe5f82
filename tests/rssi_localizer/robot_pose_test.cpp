// The robot's own pose: expected ranges, scan model, filter, and what becomes of odometry that
// breaks off.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "services/rssi_localizer/robot_localizer.hpp"
#include "tests/rssi_localizer/example_site.hpp"

namespace beckon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// A closed flat of 10 x 8 m: a wall across with a doorway, and a short one that makes the halves
// differ.
FloorPlan TwoRooms() {
  FloorPlan plan;
  plan.min = {0.0, 0.0};
  plan.max = {10.0, 8.0};
  plan.outline = {{0.0, 0.0}, {10.0, 0.0}, {10.0, 8.0}, {0.0, 8.0}};
  plan.walls = {
      {{6.0, 0.0}, {6.0, 5.0}, {}}, {{6.0, 6.0}, {6.0, 8.0}, {}}, {{0.0, 5.5}, {2.5, 5.5}, {}}};
  return plan;
}

Site ExampleFlat() {
  Site site = testing::ExampleSite();
  site.plan = TwoRooms();
  return site;
}

// A camera of 60 degrees that sees the floor from 0.4 to 6 m, and all walls where the plan has
// them.
RangeScan Look(const FloorPlan& plan, const Pose2& map_from_robot) {
  constexpr int kRays = 61;
  constexpr double kFarM = 6.0;
  RangeScan scan;
  scan.first_bearing_rad = -kPi / 6.0;
  scan.bearing_step_rad = kPi / 3.0 / (kRays - 1);
  for (int i = 0; i < kRays; ++i) {
    const double bearing = scan.first_bearing_rad + i * scan.bearing_step_rad;
    const double range =
        plan.CastRay(map_from_robot.translation(), map_from_robot.theta + bearing, kFarM);
    scan.ranges_m.push_back(static_cast<float>(range));
    scan.ground_seen_m.push_back(static_cast<float>(std::min(range, kFarM)));
  }
  return scan;
}

double HeadingError(const Pose2& a, const Pose2& b) {
  return std::abs(WrapAngle(a.theta - b.theta));
}
double Distance(const Pose2& a, const Pose2& b) {
  return (a.translation() - b.translation()).norm();
}

TEST(PlanField, RangesAreThoseOfTheFloorPlan) {
  const FloorPlan plan = TwoRooms();
  const PlanField field(plan);
  EXPECT_TRUE(field.has_walls());
  for (const Eigen::Vector2d& from : {Eigen::Vector2d(1.0, 1.0), {5.5, 5.5}, {8.0, 3.0}}) {
    for (int i = 0; i < 48; ++i) {
      // Off the axes and the corners, where a cell decides between two walls.
      const double bearing = 2.0 * kPi * (i + 0.3) / 48;
      const double expected = plan.CastRay(from, bearing, 20.0);
      const Eigen::Vector2d direction(std::cos(bearing), std::sin(bearing));
      const double range = field.Range(from.cast<float>(), direction.cast<float>(), 20.0F);
      // A wall begins earlier by its cell; by more of the ray where that meets it at a flat angle.
      EXPECT_LE(range, expected + 0.05) << from.transpose() << " " << bearing;
      if (std::abs(std::sin(2.0 * bearing)) > 0.5) {
        EXPECT_NEAR(range, expected, 0.05 / std::sin(kPi / 12.0));
      }
    }
  }
}

TEST(PlanField, APlanWithoutWallsStopsNothing) {
  const PlanField field(testing::ExampleSite().plan);
  EXPECT_FALSE(field.has_walls());
  EXPECT_EQ(field.Range({5.0F, 4.0F}, {1.0F, 0.0F}, 100.0F), kInf);
  EXPECT_TRUE(field.IsFree({5.0, 4.0}));
  EXPECT_FALSE(field.IsFree({11.0, 4.0}));
}

TEST(ScanModel, PrefersWhereTheWallsFit) {
  const FloorPlan plan = TwoRooms();
  const ScanModel model(plan, {});
  const Pose2 truth{3.0, 2.0, 0.4};
  const ScanModel::View view = model.Prepare(Look(plan, truth));
  const double there = model.LogLikelihood(view, truth);
  EXPECT_GT(there, model.LogLikelihood(view, {3.5, 2.0, 0.4}));
  EXPECT_GT(there, model.LogLikelihood(view, {3.0, 2.0, 0.7}));
  EXPECT_GT(there, model.LogLikelihood(view, {8.0, 4.0, -2.0}));
}

// The same deviation, one way or the other: before the wall stands a cupboard, behind it lies what
// the plan says cannot be seen.
TEST(ScanModel, FurnitureIsCommonAndSeeingThroughWallsIsNot) {
  const FloorPlan plan = TwoRooms();
  const ScanModel model(plan, {});
  const Pose2 pose{3.0, 2.0, 0.0};
  RangeScan nearer = Look(plan, pose);
  RangeScan farther = nearer;
  RangeScan open = nearer;
  for (std::size_t i = 0; i < nearer.ranges_m.size(); ++i) {
    nearer.ranges_m[i] -= 1.0F;
    nearer.ground_seen_m[i] -= 1.0F;
    farther.ranges_m[i] += 1.0F;
    farther.ground_seen_m[i] += 1.0F;
    open.ranges_m[i] = kInf;
    open.ground_seen_m[i] = 6.0F;
  }
  const double with_cupboard = model.LogLikelihood(model.Prepare(nearer), pose);
  EXPECT_GT(with_cupboard, model.LogLikelihood(model.Prepare(farther), pose) + 5.0);
  // Free floor through a wall, against free floor where there is none.
  const ScanModel::View free = model.Prepare(open);
  EXPECT_LT(model.LogLikelihood(free, pose), model.LogLikelihood(free, {0.5, 2.5, -0.1}) - 2.0);
}

TEST(ScanModel, UndeterminedRaysSayNothing) {
  const FloorPlan plan = TwoRooms();
  const ScanModel model(plan, {});
  RangeScan scan = Look(plan, {3.0, 2.0, 0.0});
  std::fill(scan.ranges_m.begin(), scan.ranges_m.end(), kNan);
  EXPECT_TRUE(model.Prepare(scan).empty());
}

TEST(ScanModel, NonsenseIsRefused) {
  const FloorPlan plan = TwoRooms();
  const ScanModel model(plan, {});
  const RangeScan good = Look(plan, {3.0, 2.0, 0.0});
  RangeScan scan = good;
  scan.ranges_m[3] = -1.0F;
  EXPECT_THROW(model.Prepare(scan), std::invalid_argument);
  scan = good;
  scan.ground_seen_m.pop_back();
  EXPECT_THROW(model.Prepare(scan), std::invalid_argument);
  scan = good;
  scan.bearing_step_rad = std::nan("");
  EXPECT_THROW(model.Prepare(scan), std::invalid_argument);
  EXPECT_THROW(model.Prepare({}), std::invalid_argument);
}

TEST(SystematicDraw, TakesEachAsOftenAsItsWeightSays) {
  std::mt19937_64 random(1);
  std::vector<int> counts(4, 0);
  for (const std::size_t i : SystematicDraw({0.1, 0.0, 0.6, 0.3}, 100, random)) ++counts[i];
  EXPECT_NEAR(counts[0], 10, 1);
  EXPECT_EQ(counts[1], 0);
  EXPECT_NEAR(counts[2], 60, 1);
  EXPECT_NEAR(counts[3], 30, 1);
}

// A robot that drives round the larger room, looking about; odometry as it is told to be.
class Flat : public ::testing::Test {
 protected:
  Flat() : localizer_(SiteModel::Fit(site_, {}, {}), {}) { Make({}); }

  void Make(const RobotLocalizerOptions& options) { robot_.emplace(localizer_.model(), options); }

  // One step of a tenth of a second with these velocities.
  void Step(double linear_mps, double angular_radps) {
    const Pose2 motion{0.1 * linear_mps, 0.0, 0.1 * angular_radps};
    truth_ = truth_ * motion;
    clock_.Advance(std::chrono::milliseconds(100));
    const Instant now = clock_.Now();
    for (std::size_t i = 0; i < site_.beacons.size(); ++i) {
      const double distance =
          BeaconDistance(site_.beacons[i], site_.tag_height_m, truth_.translation());
      const Reading reading{now.utime, "robot", site_.beacons[i].id,
                            PathLoss{}.MeanRssi(static_cast<int>(i), distance, 0)};
      localizer_.Add(reading, now);
      robot_->AddReading(reading);
    }
    if (++steps_ % 5 == 0) {
      for (const TagLocation& location : localizer_.Update(now)) robot_->AddLocation(location);
    }
    if (uses_odometry_) {
      odometry_ = odometry_ * Pose2{odometry_scale_ * motion.x, 0.0, motion.theta};
      pose_ = robot_->AddOdometry(now, now.utime, odometry_);
    } else {
      pose_ = robot_->AddGroundMotion(now, now.utime - 100'000, now.utime, motion);
    }
    if (sees_) robot_->AddScan(now, now.utime, Look(site_.plan, truth_));
  }
  void TurnRound() {
    for (int i = 0; i < 70; ++i) Step(0.0, 0.9);
  }
  // Once round a circle of 1 m radius.
  void DriveRound() {
    for (int i = 0; i < 126; ++i) Step(0.5, 0.5);
  }
  void ExpectRight(double metres = 0.15, double radians = 0.05) {
    ASSERT_TRUE(pose_) << robot_->Doubt(clock_.Now());
    EXPECT_LT(Distance(*pose_, truth_), metres);
    EXPECT_LT(HeadingError(*pose_, truth_), radians);
    EXPECT_EQ(robot_->Doubt(clock_.Now()), "");
  }

  Site site_ = ExampleFlat();
  Localizer localizer_;
  std::optional<RobotLocalizer> robot_;
  ManualClock clock_;
  Pose2 truth_{3.0, 2.0, 0.5};
  Pose2 odometry_{-7.0, 11.0, 2.0};  // its frame is anywhere
  double odometry_scale_ = 1.0;
  bool uses_odometry_ = true;
  bool sees_ = true;
  int steps_ = 0;
  std::optional<Pose2> pose_;
};

TEST_F(Flat, TheRobotFindsItself) {
  Step(0.0, 0.0);
  EXPECT_FALSE(pose_);
  EXPECT_NE(robot_->Doubt(clock_.Now()), "");
  TurnRound();
  DriveRound();
  ExpectRight();
}

TEST_F(Flat, TheMotionOfTheGroundWillDo) {
  uses_odometry_ = false;
  TurnRound();
  DriveRound();
  ExpectRight();
}

TEST_F(Flat, ItNoticesThatItWasCarriedAway) {
  TurnRound();
  DriveRound();
  ExpectRight();
  truth_ = {8.0, 3.0, -1.0};  // and the wheels counted nothing
  TurnRound();
  // 13 m: the room looks nearly the same from the opposite place.
  DriveRound();
  DriveRound();
  ExpectRight();
}

TEST_F(Flat, AKnownStartIsKeptAndDriftRemoved) {
  RobotLocalizerOptions options;
  options.map_from_odometry = truth_ * odometry_.Inverse();
  Make(options);
  odometry_scale_ = 1.05;
  Step(0.0, 0.0);
  ExpectRight(0.05, 0.02);
  for (int round = 0; round < 3; ++round) DriveRound();
  // Odometry alone is off by a decimetre in every direction in turn, and by a metre of the way.
  ExpectRight(0.12, 0.05);
}

TEST_F(Flat, AKnownStartHoldsWhateverArrivesBeforeTheOdometry) {
  RobotLocalizerOptions options;
  options.map_from_odometry = truth_ * odometry_.Inverse();
  Make(options);
  const Instant now = clock_.Now();
  robot_->AddScan(now, now.utime, Look(site_.plan, truth_));
  EXPECT_FALSE(robot_->AddGroundMotion(now, now.utime - 100'000, now.utime, Pose2{}));
  Step(0.0, 0.0);
  ExpectRight(0.05, 0.02);
}

TEST_F(Flat, WithoutOdometryAKnownStartIsThatOfTheGroundsMotion) {
  RobotLocalizerOptions options;
  options.map_from_odometry = truth_;
  Make(options);
  uses_odometry_ = false;
  Step(0.0, 0.0);
  EXPECT_FALSE(pose_) << "odometry may still come";
  for (int i = 0; i < 8; ++i) Step(0.0, 0.0);
  ExpectRight(0.05, 0.02);
}

TEST_F(Flat, OdometryThatStartsAnewCostsLittle) {
  TurnRound();
  DriveRound();
  ExpectRight();
  odometry_ = {100.0, 0.0, 0.0};
  for (int i = 0; i < 10; ++i) Step(0.3, 0.5);
  DriveRound();
  ExpectRight();
}

TEST_F(Flat, WithoutScansThereIsNoPose) {
  sees_ = false;
  TurnRound();
  DriveRound();
  EXPECT_FALSE(pose_);
  EXPECT_THAT(robot_->Doubt(clock_.Now()), ::testing::HasSubstr("SCAN"));
}

TEST_F(Flat, StandingStillNothingBecomesSurer) {
  for (int i = 0; i < 300; ++i) Step(0.0, 0.0);
  EXPECT_FALSE(pose_) << "one view of a wall cannot tell where the robot is";
}

TEST(RobotPoseFilter, TheSameSeedAndInputGiveTheSamePose) {
  const FloorPlan plan = TwoRooms();
  const FloorGrid grid(plan, {});
  const auto run = [&](std::uint64_t seed) {
    PoseFilterOptions options;
    options.seed = seed;
    RobotPoseFilter filter(plan, grid, options);
    for (int i = 0; i < 20; ++i) {
      filter.AddScan(Look(plan, {3.0, 2.0, 0.2 * i}));
      filter.Move({0.0, 0.0, 0.2});
    }
    return filter.belief().map_from_robot;
  };
  EXPECT_EQ(run(1).x, run(1).x);
  EXPECT_NE(run(1).x, run(2).x);
  EXPECT_LT(Distance(run(1), {3.0, 2.0, 4.0}), 0.15);
}

TEST(RobotPoseFilter, NeedsFewParticlesWhereItIsSure) {
  const FloorPlan plan = TwoRooms();
  const FloorGrid grid(plan, {});
  const PoseFilterOptions options;
  RobotPoseFilter filter(plan, grid, options);
  EXPECT_EQ(filter.particles(), options.max_particles);
  filter.StartAt({3.0, 2.0, 0.0}, 0.1, 0.05);
  EXPECT_TRUE(filter.is_located());
  for (int i = 0; i < 20; ++i) {
    filter.AddScan(Look(plan, {3.0, 2.0, 0.2 * i}));
    filter.Move({0.0, 0.0, 0.2});
  }
  EXPECT_LT(filter.particles(), options.max_particles / 8);
}

}  // namespace
}  // namespace beckon
