// Motion over the ground, from matches and from brightness.
#include "services/ground_detector/motion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>
#include <random>

#include "services/ground_detector/alignment.hpp"
#include "services/ground_detector/motion_filter.hpp"
#include "tests/ground_detector/scene.hpp"

namespace beckon {
namespace {

using testing::Render;
using testing::Scene;
using testing::TestCamera;

// Nothing known of the motion but what a robot can do in a tenth of a second, and that the body
// leans by some `lean_rad`.
MotionPrior Vague(double lean_rad = 0.001) {
  MotionPrior prior;
  prior.information.diagonal() << 100.0, 1000.0, 50.0, 1.0 / (lean_rad * lean_rad),
      1.0 / (lean_rad * lean_rad);
  return prior;
}

// Points of the ground before a robot at `pose`, as that robot sees them, with noise.
std::vector<GroundMatch> MakeMatches(const GroundCamera& camera, const BodyPose& pose, int count,
                                     double noise_px, unsigned seed) {
  const GroundCamera leaning = Rocked(camera, pose.pitch_rad, pose.roll_rad);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(0.8, 4.0);
  std::uniform_real_distribution<double> y(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, noise_px);
  std::vector<GroundMatch> matches;
  while (static_cast<int>(matches.size()) < count) {
    const Eigen::Vector2d seen(x(random), y(random));
    const auto pixel = leaning.PixelFromGround(seen);
    if (!pixel) continue;
    matches.push_back({pose.frame_from_robot * seen,
                       *pixel + Eigen::Vector2d(noise(random), noise(random)), 1.0});
  }
  return matches;
}

TEST(ApparentMotion, IsWhatALeaningCameraThatTakesItselfForLevelSees) {
  const GroundCamera camera = TestCamera();
  const Eigen::Vector2d point(1.7, -0.6);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 5; ++i) {
    Vector5d step = Vector5d::Zero();
    step(i) = kStep;
    const BodyPose pose = Moved({}, step);
    const GroundCamera leaning = Rocked(camera, pose.pitch_rad, pose.roll_rad);
    const auto pixel = leaning.PixelFromGround(pose.frame_from_robot.Inverse() * point);
    const Eigen::Vector2d apparent = (*camera.GroundFromPixel(*pixel) - point) / kStep;
    EXPECT_NEAR((apparent - ApparentMotion(point, camera.height_m).col(i)).norm(), 0.0, 1e-3) << i;
  }
}

TEST(EstimatePose, IsExactWithoutNoise) {
  const GroundCamera camera = TestCamera();
  const BodyPose pose{{0.12, -0.04, 0.1}, 0.0, 0.0};
  const auto estimate = EstimatePose(camera, MakeMatches(camera, pose, 60, 0.0, 1), Vague(), {});
  ASSERT_EQ(estimate.status, MotionStatus::kOk);
  EXPECT_EQ(estimate.inliers, 60);
  EXPECT_NEAR(StepBetween(pose, estimate.pose).norm(), 0.0, 5e-4);  // the prior has its say
}

TEST(EstimatePose, SeparatesLeanFromMotion) {
  const GroundCamera camera = TestCamera();
  const BodyPose pose{{0.05, -0.01, 0.03}, RadiansFromDegrees(1.0), RadiansFromDegrees(-0.6)};
  const auto matches = MakeMatches(camera, pose, 120, 0.3, 7);
  const auto estimate = EstimatePose(camera, matches, Vague(0.02), {});
  ASSERT_EQ(estimate.status, MotionStatus::kOk);
  const Vector5d error = StepBetween(pose, estimate.pose);
  EXPECT_LT(error.head<2>().norm(), 0.004);
  EXPECT_LT(error.tail<3>().cwiseAbs().maxCoeff(), 0.002);
  // A body that is held to be rigid cannot explain the same picture.
  const auto rigid = EstimatePose(camera, matches, Vague(1e-6), {});
  EXPECT_GT(StepBetween(pose, rigid.pose).head<3>().norm(), 3.0 * error.head<3>().norm());
}

TEST(EstimatePose, BearsOutliersAndTellsThemApart) {
  const GroundCamera camera = TestCamera();
  const BodyPose pose{{0.05, 0.01, 0.02}, 0.0, 0.0};
  auto matches = MakeMatches(camera, pose, 100, 0.4, 2);
  // What stands on the ground, where it moves a good deal faster.
  for (std::size_t i = 0; i < 40; ++i) matches[i].pixel += Eigen::Vector2d(9.0, -7.0);
  const auto estimate = EstimatePose(camera, matches, Vague(), {});
  ASSERT_EQ(estimate.status, MotionStatus::kOk);
  EXPECT_LT(StepBetween(pose, estimate.pose).head<3>().cwiseAbs().maxCoeff(), 0.004);
  for (std::size_t i = 0; i < 40; ++i) EXPECT_FALSE(estimate.inlier[i]) << i;
  EXPECT_GE(estimate.inliers, 55);
}

TEST(EstimatePose, CovarianceIsTheSpreadThatIsSeen) {
  const GroundCamera camera = TestCamera();
  const BodyPose pose{{0.05, 0.0, 0.4}, 0.0, 0.0};
  MotionPrior prior = Vague();
  prior.pose = pose;
  Matrix5d scatter = Matrix5d::Zero();
  Matrix5d claimed = Matrix5d::Zero();
  constexpr int kRuns = 100;
  for (unsigned run = 0; run < kRuns; ++run) {
    const auto estimate = EstimatePose(camera, MakeMatches(camera, pose, 50, 0.5, run), prior, {});
    ASSERT_EQ(estimate.status, MotionStatus::kOk);
    const Vector5d error = StepBetween(pose, estimate.pose);
    scatter += error * error.transpose() / kRuns;
    claimed += estimate.covariance / kRuns;
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(claimed(i, i), 0.4 * scatter(i, i)) << i;
    EXPECT_LT(claimed(i, i), 2.5 * scatter(i, i)) << i;
  }
}

TEST(EstimatePose, SaysWhenItDoesNotKnow) {
  const GroundCamera camera = TestCamera();
  EXPECT_EQ(EstimatePose(camera, MakeMatches(camera, {}, 5, 0.0, 3), Vague(), {}).status,
            MotionStatus::kTooFewFeatures);
  // Every match moves as it likes.
  auto matches = MakeMatches(camera, {}, 80, 0.0, 4);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-60.0, 60.0);
  for (GroundMatch& match : matches)
    match.pixel += Eigen::Vector2d(anywhere(random), anywhere(random));
  EXPECT_NE(EstimatePose(camera, matches, Vague(), {}).status, MotionStatus::kOk);
}

TEST(BeforeFromNow, MovesPointsOfAPlaneAboveTheGround) {
  const GroundCamera camera = TestCamera();
  const BodyPose before{{}, 0.01, 0.0};
  const BodyPose now{{0.2, -0.05, 0.1}, -0.005, 0.02};
  constexpr double kHeight = 0.15;
  // A point at height z is seen where the ray over it meets the ground.
  const auto pixel_of = [&](const Eigen::Vector2d& point, const BodyPose& pose) {
    return *Rocked(camera, pose.pitch_rad, pose.roll_rad)
                .PixelFromGround(point * camera.height_m / (camera.height_m - kHeight));
  };
  const Eigen::Vector2d point(1.3, 0.2);
  const Eigen::Vector2d seen_now = pixel_of(point, now);
  const Eigen::Vector2d seen_before = pixel_of(now.frame_from_robot * point, before);
  const Eigen::Vector2d moved =
      (BeforeFromNow(camera, before, now, kHeight / camera.height_m) * seen_now.homogeneous())
          .hnormalized();
  EXPECT_NEAR((moved - seen_before).norm(), 0.0, 1e-9);
}

TEST(CheckHomography, AgreesWithTheTrueMotionAndNotWithAnother) {
  const GroundCamera camera = TestCamera();
  const BodyPose now{{0.06, 0.0, 0.02}, 0.0, 0.0};
  std::vector<Eigen::Vector2d> before;
  std::vector<Eigen::Vector2d> after;
  for (const GroundMatch& match : MakeMatches(camera, now, 60, 0.3, 11)) {
    before.push_back(*camera.PixelFromGround(match.point));
    after.push_back(match.pixel);
  }
  // Some move by themselves.
  for (std::size_t i = 0; i < 15; ++i) after[i] += Eigen::Vector2d(11.0, -8.0);
  const auto good = CheckHomography(before, after, BeforeFromNow(camera, now, {}, 0.0), 2.0);
  EXPECT_GE(good.explained, 40);
  EXPECT_LT(good.difference_px, 0.5);
  const auto bad = CheckHomography(before, after, Eigen::Matrix3d::Identity(), 2.0);
  EXPECT_GT(bad.difference_px, 3.0);
  EXPECT_EQ(CheckHomography(std::span(before).first(7), std::span(after).first(7),
                            Eigen::Matrix3d::Identity(), 2.0)
                .explained,
            0);
}

constexpr double kDt = 0.1;

Matrix5d Exact() { return 1e-12 * Matrix5d::Identity(); }

TEST(MotionFilter, GoesOnAsBefore) {
  MotionFilter filter({}, {});
  EXPECT_FALSE(filter.knows_velocity());
  const Pose2 step{0.05, 0.0, 0.02};
  BodyPose pose;
  for (int i = 0; i < 5; ++i) {
    pose.frame_from_robot = pose.frame_from_robot * step;
    filter.Update(kDt, pose, Exact(), false);
  }
  const MotionPrior next = filter.Predict(kDt);
  pose.frame_from_robot = pose.frame_from_robot * step;
  EXPECT_NEAR(StepBetween(pose, next.pose).norm(), 0.0, 1e-3);
  // Pose known, velocity known: what is left is acceleration, 0.25 m/s2 for a tenth of a second.
  EXPECT_NEAR(1.0 / std::sqrt(next.information(0, 0)), 0.5 * 0.25 * kDt * kDt, 5e-4);
  // The longer ahead, the less is known.
  EXPECT_LT(filter.Predict(5.0 * kDt).information(0, 0), 0.1 * next.information(0, 0));
}

TEST(MotionFilter, KnowsThatWheelsDoNotGoSideways) {
  MotionFilter filter({}, {});
  BodyPose pose;
  for (int i = 0; i < 5; ++i) {
    pose.frame_from_robot = pose.frame_from_robot * Pose2{0.05, 0.0, 0.0};
    filter.Update(kDt, pose, Exact(), false);
  }
  // Slip of 2 % of half a metre a second for a tenth of a second.
  const MotionPrior next = filter.Predict(kDt);
  EXPECT_NEAR(1.0 / std::sqrt(next.information(1, 1)), 0.02 * 0.05, 2e-4);
}

// Poses of a robot that turns on the spot about a centre 0.2 m behind the origin of its frame.
constexpr double kCentreX = -0.2;
Pose2 AboutCentre(double theta) {
  return {kCentreX - kCentreX * std::cos(theta), -kCentreX * std::sin(theta), theta};
}

TEST(MotionFilter, TurningMovesTheFrameSidewaysAboutTheKnownCentre) {
  RobotOptions robot;
  robot.centre_x_m = kCentreX;
  MotionFilter filter(robot, {});
  const BodyPose pose{AboutCentre(0.05), 0.0, 0.0};
  filter.Update(kDt, pose, Exact(), false);
  const BodyPose expected{AboutCentre(0.1), 0.0, 0.0};
  EXPECT_LT(StepBetween(expected, filter.Predict(kDt).pose).norm(), 1e-3);
}

TEST(MotionFilter, LearnsWhereTheCentreIs) {
  MotionFilterOptions options;
  options.centre_sigma_m = 0.3;
  MotionFilter filter({}, options);
  for (int i = 1; i <= 10; ++i) {
    filter.Update(kDt, {AboutCentre(0.05 * i), 0.0, 0.0}, Exact(), false);
  }
  // Not forgotten when matching starts anew, at any other rate of turn.
  filter.Restart();
  filter.Update(kDt, {AboutCentre(-0.08), 0.0, 0.0}, Exact(), false);
  const BodyPose expected{AboutCentre(-0.16), 0.0, 0.0};
  EXPECT_LT(StepBetween(expected, filter.Predict(kDt).pose).norm(), 1e-3);
}

TEST(MotionFilter, LearnsHowMuchTheBodyLeansFromWhatShows) {
  MotionFilter filter({}, {});
  const double first = filter.lean_rad();
  const BodyPose leaning{{}, 0.02, -0.02};
  filter.Update(kDt, leaning, Exact(), false);
  EXPECT_DOUBLE_EQ(filter.lean_rad(), first);
  filter.Update(kDt, leaning, Exact(), true);
  EXPECT_NEAR(filter.lean_rad(), 0.02, 1e-6);
  for (int i = 0; i < 200; ++i) filter.Update(kDt, {}, Exact(), true);
  EXPECT_LT(filter.lean_rad(), first);
}

struct Look {
  GreyPyramid pyramid;
  GroundTexture texture;
};
Look LookAt(const Scene& scene, const BodyPose& pose, unsigned seed) {
  const auto view =
      Render(scene, TestCamera(), pose.frame_from_robot, seed, pose.pitch_rad, pose.roll_rad);
  cv::Mat grey;
  cv::cvtColor(view.bgr, grey, cv::COLOR_BGR2GRAY);
  Look look{MakePyramid(grey), {}};
  look.texture = TakeGroundTexture(Rocked(TestCamera(), pose.pitch_rad, pose.roll_rad),
                                   look.pyramid, view.labels, {});
  return look;
}

// From the origin, where the body stands level.
Alignment AlignFromOrigin(const Scene& scene, const BodyPose& pose, const BodyPose& start,
                          const MotionPrior& prior, bool from_coarse) {
  const Look before = LookAt(scene, {}, 2);
  const Look now = LookAt(scene, pose, 1);
  const std::vector<AlignmentReference> references = {{&before.texture, {}}};
  return AlignGround(TestCamera(), now.pyramid, references, start, prior, from_coarse, {});
}

TEST(AlignGround, MeasuresMotionToAFractionOfAPixel) {
  const BodyPose pose{{0.05, 0.004, 0.015}, 0.0, 0.0};
  const auto alignment = AlignFromOrigin({}, pose, {{0.046, 0.0, 0.01}, 0.0, 0.0}, Vague(), false);
  ASSERT_TRUE(alignment.ok);
  EXPECT_LT(StepBetween(pose, alignment.pose).head<3>().cwiseAbs().maxCoeff(), 0.0015);
  EXPECT_LT(std::sqrt(alignment.covariance(0, 0)), 0.002);
}

TEST(AlignGround, FindsItsWayFromAPoorPrediction) {
  const BodyPose pose{{0.05, 0.0, 0.02}, 0.0, 0.0};
  const auto alignment = AlignFromOrigin({}, pose, {}, Vague(), true);
  ASSERT_TRUE(alignment.ok);
  EXPECT_LT(StepBetween(pose, alignment.pose).head<3>().cwiseAbs().maxCoeff(), 0.002);
}

TEST(AlignGround, SeesTheBodyLean) {
  const BodyPose pose{{0.05, 0.0, 0.01}, RadiansFromDegrees(0.8), RadiansFromDegrees(-0.5)};
  const auto alignment = AlignFromOrigin({}, pose, {}, Vague(0.02), true);
  ASSERT_TRUE(alignment.ok);
  const Vector5d error = StepBetween(pose, alignment.pose);
  EXPECT_LT(error.head<2>().norm(), 0.002);
  EXPECT_LT(error.tail<2>().norm(), RadiansFromDegrees(0.06));
}

TEST(AlignGround, AdmitsWhatTheFloorDoesNotShow) {
  const BodyPose pose{{0.05, 0.0, 0.0}, 0.0, 0.0};
  const auto sigma_along = [&](const Scene& scene) {
    const auto alignment = AlignFromOrigin(scene, pose, {}, Vague(), true);
    return alignment.ok ? std::sqrt(alignment.covariance(0, 0)) : 1.0;
  };
  // The prior is good for 0.1 m; a detector that believes 0.015 m would be content.
  Scene boards;
  boards.floor_of_boards = true;
  boards.wall_x = 100.0;
  EXPECT_GT(sigma_along(boards), 0.018);
  Scene plain;
  plain.floor_contrast = 0.0;
  plain.wall_x = 100.0;
  EXPECT_GT(sigma_along(plain), 0.018);
  // The foot of a wall is ground as well, and shows it.
  const double nothing_to_see = sigma_along(plain);
  boards.wall_x = 3.0;
  EXPECT_LT(sigma_along(boards), 0.5 * nothing_to_see);
}

}  // namespace
}  // namespace beckon
