// Motion over the ground, from matches and from brightness.
#include "services/ground_detector/motion.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "services/ground_detector/alignment.hpp"
#include "tests/ground_detector/scene.hpp"

namespace beckon {
namespace {

using testing::Render;
using testing::Scene;
using testing::TestCamera;

// Points of the ground before a robot at `pose`, as that robot sees them, with noise.
std::vector<GroundMatch> MakeMatches(const GroundCamera& camera, const Pose2& pose, int count,
                                     double noise_px, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(0.8, 4.0);
  std::uniform_real_distribution<double> y(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, noise_px);
  std::vector<GroundMatch> matches;
  while (static_cast<int>(matches.size()) < count) {
    const Eigen::Vector2d seen(x(random), y(random));
    const auto pixel = camera.PixelFromGround(seen);
    if (!pixel) continue;
    matches.push_back({pose * seen, *pixel + Eigen::Vector2d(noise(random), noise(random)), 1.0});
  }
  return matches;
}

TEST(EstimatePose, IsExactWithoutNoise) {
  const GroundCamera camera = TestCamera();
  const Pose2 pose{1.2, -0.4, 0.3};
  const auto estimate = EstimatePose(camera, MakeMatches(camera, pose, 60, 0.0, 1), Pose2{}, {});
  ASSERT_EQ(estimate.status, MotionStatus::kOk);
  EXPECT_EQ(estimate.inliers, 60);
  EXPECT_NEAR(estimate.frame_from_robot.x, pose.x, 1e-5);
  EXPECT_NEAR(estimate.frame_from_robot.y, pose.y, 1e-5);
  EXPECT_NEAR(estimate.frame_from_robot.theta, pose.theta, 1e-5);
}

TEST(EstimatePose, BearsOutliersAndTellsThemApart) {
  const GroundCamera camera = TestCamera();
  const Pose2 pose{0.05, 0.01, 0.02};
  auto matches = MakeMatches(camera, pose, 100, 0.4, 2);
  // What stands on the ground, where it moves a good deal faster.
  for (std::size_t i = 0; i < 40; ++i) matches[i].pixel += Eigen::Vector2d(9.0, -7.0);
  const auto estimate = EstimatePose(camera, matches, Pose2{}, {});
  ASSERT_EQ(estimate.status, MotionStatus::kOk);
  EXPECT_NEAR(estimate.frame_from_robot.x, pose.x, 0.004);
  EXPECT_NEAR(estimate.frame_from_robot.y, pose.y, 0.004);
  EXPECT_NEAR(estimate.frame_from_robot.theta, pose.theta, 0.004);
  for (std::size_t i = 0; i < 40; ++i) EXPECT_FALSE(estimate.inlier[i]) << i;
  EXPECT_GE(estimate.inliers, 55);
}

TEST(EstimatePose, CovarianceIsTheSpreadThatIsSeen) {
  const GroundCamera camera = TestCamera();
  const Pose2 pose{0.05, 0.0, 0.0};
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d claimed = Eigen::Matrix3d::Zero();
  constexpr int kRuns = 100;
  for (unsigned run = 0; run < kRuns; ++run) {
    const auto estimate = EstimatePose(camera, MakeMatches(camera, pose, 50, 0.5, run), pose, {});
    ASSERT_EQ(estimate.status, MotionStatus::kOk);
    const Eigen::Vector3d error(estimate.frame_from_robot.x - pose.x,
                                estimate.frame_from_robot.y - pose.y,
                                estimate.frame_from_robot.theta - pose.theta);
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
  EXPECT_EQ(EstimatePose(camera, MakeMatches(camera, {}, 5, 0.0, 3), {}, {}).status,
            MotionStatus::kTooFewFeatures);
  // Every match moves as it likes.
  auto matches = MakeMatches(camera, {}, 80, 0.0, 4);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-60.0, 60.0);
  for (GroundMatch& match : matches)
    match.pixel += Eigen::Vector2d(anywhere(random), anywhere(random));
  EXPECT_NE(EstimatePose(camera, matches, {}, {}).status, MotionStatus::kOk);
}

TEST(BeforeFromNow, MovesPointsOfAPlaneAboveTheGround) {
  const GroundCamera camera = TestCamera();
  const Pose2 before_from_now{0.2, -0.05, 0.1};
  constexpr double kHeight = 0.15;
  // A point at height z is seen where the ray over it meets the ground.
  const auto pixel_of = [&](const Eigen::Vector2d& point) {
    return *camera.PixelFromGround(point * camera.height_m / (camera.height_m - kHeight));
  };
  const Eigen::Vector2d point(1.3, 0.2);
  const Eigen::Vector2d now = pixel_of(point);
  const Eigen::Vector2d before = pixel_of(before_from_now * point);
  const Eigen::Vector3d moved = BeforeFromNow(camera, before_from_now, kHeight / camera.height_m) *
                                Eigen::Vector3d(now.x(), now.y(), 1.0);
  EXPECT_NEAR(moved.x() / moved.z(), before.x(), 1e-9);
  EXPECT_NEAR(moved.y() / moved.z(), before.y(), 1e-9);
}

GreyPyramid Look(const Scene& scene, const Pose2& pose, unsigned seed) {
  cv::Mat grey;
  cv::cvtColor(Render(scene, TestCamera(), pose, seed).bgr, grey, cv::COLOR_BGR2GRAY);
  return MakePyramid(grey);
}

cv::Mat LowerPart() {
  cv::Mat ground(24, 32, CV_8UC1, cv::Scalar(0));
  ground.rowRange(8, 24).setTo(255);
  return ground;
}

TEST(AlignGround, MeasuresMotionToAFractionOfAPixel) {
  const Scene scene;
  const Pose2 before_from_now{0.05, 0.004, 0.015};
  const auto alignment =
      AlignGround(TestCamera(), Look(scene, before_from_now, 1), Look(scene, {}, 2), LowerPart(),
                  {0.046, 0.0, 0.01}, false, {});
  ASSERT_TRUE(alignment.ok);
  EXPECT_NEAR(alignment.before_from_now.x, 0.05, 0.001);
  EXPECT_NEAR(alignment.before_from_now.y, 0.004, 0.001);
  EXPECT_NEAR(alignment.before_from_now.theta, 0.015, 0.001);
}

TEST(AlignGround, FindsItsWayFromAPoorPrediction) {
  const Scene scene;
  const Pose2 before_from_now{0.05, 0.0, 0.02};
  const auto alignment = AlignGround(TestCamera(), Look(scene, before_from_now, 1),
                                     Look(scene, {}, 2), LowerPart(), {}, true, {});
  ASSERT_TRUE(alignment.ok);
  EXPECT_NEAR(alignment.before_from_now.x, 0.05, 0.001);
  EXPECT_NEAR(alignment.before_from_now.theta, 0.02, 0.001);
}

TEST(AlignGround, AdmitsWhatTheFloorDoesNotShow) {
  const Pose2 before_from_now{0.05, 0.0, 0.0};
  Scene boards;
  boards.floor_of_boards = true;
  EXPECT_FALSE(AlignGround(TestCamera(), Look(boards, before_from_now, 1), Look(boards, {}, 2),
                           LowerPart(), {}, true, {})
                   .ok);
  Scene plain;
  plain.floor_contrast = 0.0;
  EXPECT_FALSE(AlignGround(TestCamera(), Look(plain, before_from_now, 1), Look(plain, {}, 2),
                           LowerPart(), {}, true, {})
                   .ok);
}

}  // namespace
}  // namespace beckon
