// The whole detector on rendered scenes, and its borders, pictures and messages.
#include "services/ground_detector/ground_detector.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/label_runs.hpp"
#include "services/ground_detector/borders.hpp"
#include "services/ground_detector/jpeg.hpp"
#include "services/ground_detector/messages.hpp"
#include "services/ground_detector/overlay.hpp"
#include "tests/ground_detector/scene.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using testing::Box;
using testing::Render;
using testing::Scene;
using testing::TestCamera;
using testing::View;

constexpr Utime kPeriod = 100'000;

Scene OneBox() {
  Scene scene;
  scene.boxes.push_back({{2.2, -0.4}, {2.5, 0.3}, 0.35, {60.0, 50.0, 150.0}});
  return scene;
}

GroundDetector MakeDetector(const GroundCamera& camera) {
  GroundDetectorOptions options;
  options.camera = camera;
  return GroundDetector(options);
}

// Shares of the picture: ground by truth that is called ground, and the rest that is called ground.
struct Shares {
  double recall;
  double false_ground;
};
Shares Compare(const cv::Mat& labels, const cv::Mat& truth) {
  const cv::Mat ground = truth == kGround;
  const double found = cv::countNonZero((labels == kGround) & ground);
  const double wrong = cv::countNonZero((labels == kGround) & ~ground);
  return {found / cv::countNonZero(ground), wrong / cv::countNonZero(~ground)};
}

TEST(GroundDetector, FollowsADriveTowardsABox) {
  const GroundCamera camera = TestCamera();
  const Scene scene = OneBox();
  GroundDetector detector = MakeDetector(camera);
  Pose2 pose;
  const Pose2 step{0.05, 0.0, 0.01};
  for (int frame = 0; frame < 15; ++frame) {
    const View view = Render(scene, camera, pose, static_cast<unsigned>(frame));
    const GroundFrame found = detector.Process(view.bgr, frame * kPeriod);
    EXPECT_EQ(found.utime, frame * kPeriod);
    const Shares shares = Compare(found.labels, view.labels);
    EXPECT_GT(shares.recall, 0.95) << frame;
    EXPECT_LT(shares.false_ground, 0.03) << frame;
    if (frame == 0) {
      EXPECT_EQ(found.motion.status, MotionStatus::kRestart);
    } else {
      ASSERT_EQ(found.motion.status, MotionStatus::kOk) << frame;
      EXPECT_EQ(found.motion_from, (frame - 1) * kPeriod);
      EXPECT_NEAR(found.motion.from_to.x, step.x, 0.003) << frame;
      EXPECT_NEAR(found.motion.from_to.y, step.y, 0.003) << frame;
      EXPECT_NEAR(found.motion.from_to.theta, step.theta, 0.002) << frame;
    }
    pose = pose * step;
  }
}

TEST(GroundDetector, SeesTheWayWhileStandingStillFromTheFirstFrame) {
  const GroundCamera camera = TestCamera();
  const Scene scene = OneBox();
  GroundDetector detector = MakeDetector(camera);
  for (int frame = 0; frame < 5; ++frame) {
    const View view = Render(scene, camera, {}, static_cast<unsigned>(frame));
    const GroundFrame found = detector.Process(view.bgr, frame * kPeriod);
    const Shares shares = Compare(found.labels, view.labels);
    EXPECT_GT(shares.recall, 0.95) << frame;
    EXPECT_LT(shares.false_ground, 0.03) << frame;
    EXPECT_TRUE(found.evidence.empty())
        << "nothing can be concluded from parallax that is not there";
    if (frame == 0) continue;
    ASSERT_EQ(found.motion.status, MotionStatus::kOk);
    EXPECT_LT(found.motion.from_to.translation().norm(), 0.002);
    EXPECT_LT(std::abs(found.motion.from_to.theta), 0.002);
  }
}

TEST(GroundDetector, ATwentiethOfTheCameraHeightIsWayEnoughForParallax) {
  const GroundCamera camera = TestCamera();
  const double step_m = 0.06 * camera.height_m;
  GroundDetector detector = MakeDetector(camera);
  detector.Process(Render(OneBox(), camera, {}, 0).bgr, 0);
  const GroundFrame found =
      detector.Process(Render(OneBox(), camera, {step_m, 0.0, 0.0}, 1).bgr, kPeriod);
  EXPECT_FALSE(found.evidence.empty());
}

TEST(GroundDetector, RefusesPicturesOfAnotherSizeOrKind) {
  GroundDetector detector = MakeDetector(TestCamera());
  EXPECT_THROW(detector.Process(cv::Mat(240, 319, CV_8UC3, cv::Scalar::all(90)), 0),
               std::invalid_argument);
  EXPECT_THROW(detector.Process(cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)), 0),
               std::invalid_argument);
  EXPECT_THROW(detector.Process({}, 0), std::invalid_argument);
}

TEST(GroundDetector, SaysNothingInTheDarkAndRecovers) {
  const GroundCamera camera = TestCamera();
  const Scene scene = OneBox();
  GroundDetector detector = MakeDetector(camera);
  detector.Process(Render(scene, camera, {}, 1).bgr, 0);
  const GroundFrame dark =
      detector.Process(cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(2)), kPeriod);
  EXPECT_EQ(cv::countNonZero(dark.labels != kUndetermined), 0);
  EXPECT_EQ(dark.motion.status, MotionStatus::kTooFewFeatures);
  const View view = Render(scene, camera, {}, 2);
  EXPECT_GT(Compare(detector.Process(view.bgr, 2 * kPeriod).labels, view.labels).recall, 0.95);
}

TEST(GroundDetector, StartsAfreshWhenTimeRunsBackwardsOrHasAGap) {
  const GroundCamera camera = TestCamera();
  const Scene scene = OneBox();
  GroundDetector detector = MakeDetector(camera);
  const cv::Mat picture = Render(scene, camera, {}, 1).bgr;
  detector.Process(picture, 10 * kPeriod);
  ASSERT_EQ(detector.Process(picture, 11 * kPeriod).motion.status, MotionStatus::kOk);
  for (const Utime utime : {Utime{11 * kPeriod}, Utime{2 * kPeriod}, Utime{100 * kPeriod}}) {
    const GroundFrame found = detector.Process(picture, utime);
    EXPECT_EQ(found.motion.status, MotionStatus::kRestart) << utime;
    EXPECT_EQ(found.motion_from, utime);
    EXPECT_GT(cv::countNonZero(found.labels == kGround), 0);
  }
  EXPECT_EQ(detector.Process(picture, 101 * kPeriod).motion.status, MotionStatus::kOk);
}

TEST(GroundDetector, AdmitsThatAPlainFloorShowsNoMotion) {
  const GroundCamera camera = TestCamera();
  Scene scene;
  scene.floor_contrast = 0.0;
  scene.wall_x = 100.0;
  GroundDetector detector = MakeDetector(camera);
  for (int frame = 0; frame < 5; ++frame) {
    const View view = Render(scene, camera, {0.05 * frame, 0.0, 0.0}, static_cast<unsigned>(frame));
    const GroundFrame found = detector.Process(view.bgr, frame * kPeriod);
    EXPECT_NE(found.motion.status, MotionStatus::kOk) << frame;
    EXPECT_LT(Compare(found.labels, view.labels).false_ground, 0.03) << frame;
  }
}

TEST(GroundDetector, KnowsItsMotionBetterForKnowingHowTheBodyRocks) {
  GroundDetectorOptions options;
  options.camera = TestCamera();
  GroundDetector rigid(options);
  options.body_rocks = true;
  GroundDetector leaning(options);
  Pose2 pose;
  const Pose2 step{0.04, 0.0, 0.01};
  double leaning_error = 0.0;
  double rigid_error = 0.0;
  for (int frame = 0; frame < 10; ++frame) {
    const double pitch = RadiansFromDegrees(1.0) * std::sin(0.9 * frame);
    const double roll = RadiansFromDegrees(0.7) * std::sin(1.3 * frame);
    const View view =
        Render(OneBox(), options.camera, pose, static_cast<unsigned>(frame), pitch, roll);
    // A motion that is not known counts as none.
    const auto error = [&](GroundDetector& detector) {
      const PlanarMotion motion = detector.Process(view.bgr, frame * kPeriod).motion;
      return (motion.from_to.translation() - step.translation()).norm();
    };
    leaning_error += error(leaning);
    rigid_error += error(rigid);
    pose = pose * step;
  }
  EXPECT_LT(leaning_error, 0.6 * rigid_error);
}

TEST(GroundDetector, TakesOutLensDistortion) {
  GroundCamera camera = TestCamera();
  const View ideal = Render(OneBox(), camera, {}, 1);
  camera.distortion = {-0.2, 0.04, 0.0, 0.0, 0.0};
  cv::Mat map(240, 320, CV_32FC2);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const Eigen::Vector2f pixel = camera.Undistorted({u, v}).cast<float>();
      map.at<cv::Vec2f>(v, u) = {pixel.x(), pixel.y()};
    }
  }
  cv::Mat taken;
  cv::Mat truth;
  cv::remap(ideal.bgr, taken, map, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::remap(ideal.labels, truth, map, {}, cv::INTER_NEAREST, cv::BORDER_REPLICATE);
  GroundDetector detector = MakeDetector(camera);
  const cv::Rect middle(40, 30, 240, 180);
  const Shares shares = Compare(detector.Process(taken, 0).labels(middle), truth(middle));
  EXPECT_GT(shares.recall, 0.95);
  EXPECT_LT(shares.false_ground, 0.03);
}

// Of cells that are sure.
cv::Mat LogOddsOf(const cv::Mat& ground) {
  cv::Mat log_odds;
  ground.convertTo(log_odds, CV_32FC1, 4.0 / 255.0, -2.0);
  return log_odds;
}

TEST(RefineBorders, FollowsTheCellsWhereBothSidesLookAlike) {
  // Blotches larger than what tells the sides apart, as of a wall and a floor of one material.
  cv::Mat grain(240, 320, CV_8UC3);
  cv::randn(grain, cv::Scalar::all(128), cv::Scalar::all(120));
  cv::Mat picture;
  cv::GaussianBlur(grain, picture, {0, 0}, 5.0);
  constexpr int kBorderRow = 120;
  cv::Mat truth(picture.size(), CV_8UC1, cv::Scalar(255));
  truth.rowRange(0, kBorderRow).setTo(0);
  cv::Mat coarse;
  cv::resize(truth, coarse, {32, 24}, 0.0, 0.0, cv::INTER_NEAREST);
  const auto error_px = [&](float cells_weight) {
    BorderOptions options;
    options.cells_weight = cells_weight;
    const cv::Mat refined = RefineBorders(picture, coarse, LogOddsOf(coarse), {}, options);
    return cv::countNonZero(refined != truth) / 320.0;
  };
  EXPECT_LT(error_px(BorderOptions{}.cells_weight), 4.0);
  EXPECT_LT(error_px(BorderOptions{}.cells_weight), 0.75 * error_px(0.0F));
}

TEST(RefineBorders, FindsASlantedEdgeToAPixel) {
  cv::Mat picture(240, 320, CV_8UC3, cv::Scalar(120, 140, 150));
  cv::Mat truth(picture.size(), CV_8UC1, cv::Scalar(255));
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      if (v < 90 + u / 5) {
        picture.at<cv::Vec3b>(v, u) = {90, 110, 130};
        truth.at<std::uint8_t>(v, u) = 0;
      }
    }
  }
  cv::Mat grain(picture.size(), CV_8UC3);
  cv::randn(grain, cv::Scalar::all(20), cv::Scalar::all(6));
  picture += grain;
  cv::Mat coarse;
  cv::resize(truth, coarse, {32, 24}, 0.0, 0.0, cv::INTER_NEAREST);
  const cv::Mat refined = RefineBorders(picture, coarse, LogOddsOf(coarse), {}, {});
  ASSERT_EQ(refined.size(), picture.size());
  // Wrong pixels for each column: what the border errs by on average.
  EXPECT_LT(cv::countNonZero(refined != truth) / 320.0, 0.7);
}

TEST(DrawOverlay, ShowsLabelsAndTheFootLine) {
  const cv::Mat picture(20, 10, CV_8UC3, cv::Scalar::all(100));
  cv::Mat labels(20, 10, CV_8UC1, cv::Scalar(kGround));
  labels.rowRange(0, 8).setTo(kNotGround);
  const cv::Mat drawn = DrawOverlay(picture, labels);
  const auto pixel = [&](int row) { return drawn.at<cv::Vec3b>(row, 5); };
  EXPECT_GT(pixel(15)[1], pixel(15)[2]);          // green
  EXPECT_EQ(pixel(3), cv::Vec3b(100, 100, 100));  // as it was
  EXPECT_GT(pixel(7)[2], pixel(7)[1]);            // red
  EXPECT_THROW(DrawOverlay(picture, labels.rowRange(0, 10)), std::invalid_argument);
}

TEST(DecodeJpeg, TakesWholePicturesOfTheRightSizeOnly) {
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", Render(OneBox(), TestCamera(), {}, 1).bgr, jpeg);
  EXPECT_EQ(DecodeJpeg(jpeg, 320, 240).size(), cv::Size(320, 240));
  EXPECT_THROW(DecodeJpeg(jpeg, 640, 480), std::invalid_argument);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{10}, jpeg.size() / 2, jpeg.size() - 2}) {
    EXPECT_THROW(DecodeJpeg(std::span(jpeg).first(size), 320, 240), std::invalid_argument) << size;
  }
  EXPECT_THROW(DecodeJpeg(std::vector<std::uint8_t>(1000, 0x5a), 320, 240), std::invalid_argument);
}

TEST(MakeGroundMessage, AlwaysFitsOneDatagram) {
  GroundFrame frame;
  frame.utime = 42;
  frame.labels.create(480, 640, CV_8UC1);
  frame.labels.setTo(kGround);
  cv::Mat ragged_half = frame.labels.rowRange(0, 240);
  cv::randu(ragged_half, 0, 3);
  const ground_t ragged = MakeGroundMessage(frame);
  EXPECT_LE(ragged.runs.size(), kMaxRunBytes);
  const cv::Mat decoded = DecodeLabels(ragged.runs, 640, 480);
  ASSERT_EQ(decoded.size(), frame.labels.size());
  EXPECT_EQ(cv::countNonZero((decoded == kGround) & (frame.labels != kGround)), 0)
      << "coarser, but nothing becomes ground";
  EXPECT_EQ(cv::countNonZero((frame.labels == kNotGround) & (decoded != kNotGround)), 0);
  EXPECT_EQ(cv::countNonZero(decoded.rowRange(240, 480) != kGround), 0);
  frame.labels.setTo(kGround);
  frame.labels.rowRange(0, 100).setTo(kNotGround);
  const ground_t plain = MakeGroundMessage(frame);
  EXPECT_EQ(plain.utime, 42);
  EXPECT_EQ(cv::countNonZero(DecodeLabels(plain.runs, 640, 480) != frame.labels), 0);
}

}  // namespace
}  // namespace beckon
