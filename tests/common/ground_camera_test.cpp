#include "common/ground_camera.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "common/frames.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

GroundCamera TestCamera() {
  return GroundCamera::Pinhole(640, 480, 530.0, 0.5, RadiansFromDegrees(22.0));
}

TEST(GroundCamera, OpticalAxisMeetsTheGroundWhereTrigonometrySays) {
  const GroundCamera camera = TestCamera();
  const auto point = camera.GroundFromPixel({camera.cx, camera.cy});
  ASSERT_TRUE(point);
  EXPECT_NEAR(point->x(), 0.5 / std::tan(RadiansFromDegrees(22.0)), 1e-9);
  EXPECT_NEAR(point->y(), 0.0, 1e-9);
}

TEST(GroundCamera, LeftOfTheImageIsLeftOfTheRobot) {
  const auto point = TestCamera().GroundFromPixel({100.0, 400.0});
  ASSERT_TRUE(point);
  EXPECT_GT(point->y(), 0.0);
}

TEST(GroundCamera, GroundAndPixelAreInverse) {
  const GroundCamera camera = TestCamera();
  for (double u = -50.0; u < 700.0; u += 93.0) {
    for (double v = 60.0; v < 480.0; v += 71.0) {
      const auto point = camera.GroundFromPixel({u, v});
      ASSERT_TRUE(point);
      const auto pixel = camera.PixelFromGround(*point);
      ASSERT_TRUE(pixel);
      EXPECT_NEAR(pixel->x(), u, 1e-6);
      EXPECT_NEAR(pixel->y(), v, 1e-6);
    }
  }
}

TEST(GroundCamera, HorizonAndBehindAreNotGround) {
  const GroundCamera camera = TestCamera();
  const double horizon = camera.HorizonRow(320.0);
  EXPECT_NEAR(horizon, camera.cy - 530.0 * std::tan(RadiansFromDegrees(22.0)), 1e-6);
  EXPECT_FALSE(camera.GroundFromPixel({320.0, horizon - 0.5}));
  EXPECT_TRUE(camera.GroundFromPixel({320.0, horizon + 0.5}));
  EXPECT_FALSE(camera.PixelFromGround({-1.0, 0.0}));
}

TEST(GroundCamera, ResizedSeesTheSameGround) {
  const GroundCamera camera = TestCamera();
  const GroundCamera tenth = camera.Resized(64, 48);
  // The centre of a pixel of the small image is the middle of ten by ten of the large one.
  const auto small = tenth.GroundFromPixel({30.0, 40.0});
  const auto large = camera.GroundFromPixel({304.5, 404.5});
  ASSERT_TRUE(small && large);
  EXPECT_NEAR((*small - *large).norm(), 0.0, 1e-9);
}

TEST(GroundCamera, DistortionIsUndone) {
  GroundCamera camera = TestCamera();
  camera.distortion = {-0.25, 0.08, 0.001, -0.0005, 0.01};
  for (double u = 20.0; u < 640.0; u += 150.0) {
    for (double v = 20.0; v < 480.0; v += 110.0) {
      const Eigen::Vector2d ideal(u, v);
      EXPECT_NEAR((camera.Undistorted(camera.Distorted(ideal)) - ideal).norm(), 0.0, 1e-4)
          << u << " " << v;
    }
  }
  EXPECT_GT((camera.Distorted({20.0, 20.0}) - Eigen::Vector2d(20.0, 20.0)).norm(), 5.0);
}

constexpr char kCalibration[] = R"(
width = 640
height = 480
[camera]
fx = 530.0
fy = 530.0
cx = 319.5
cy = 239.5
height_m = 0.5
tilt_down_deg = 22.0
[ground]
)";

TEST(GroundCamera, BadGeometryIsRefusedWithItsPlace) {
  testing::TempDir directory;
  const auto error_of = [&](const std::string& matrix) -> std::string {
    const auto path =
        directory.Write("camera.toml", kCalibration + ("image_to_ground = " + matrix));
    try {
      GroundCamera::Load(path);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(error_of("[1, 0, 0, 2, 0, 0, 0, 0, 1]"), ::testing::HasSubstr("singular"));
  EXPECT_THAT(error_of("[1, 2, 3]"),
              ::testing::HasSubstr("camera.toml:12: ground.image_to_ground"));
  // Looks backwards: x grows towards the top of the image and is negative at its bottom.
  EXPECT_THAT(error_of("[0, -0.01, 1, -0.01, 0, 3, 0, 0, 1]"),
              ::testing::HasSubstr("bottom of the image"));
}

TEST(GroundCamera, TheExampleToCopyIsWhatItSays) {
  const GroundCamera camera =
      GroundCamera::Load(testing::SourceDir() / "deploy/robots/example_camera.toml");
  const GroundCamera ideal =
      GroundCamera::Pinhole(640, 480, camera.fx, 0.55, RadiansFromDegrees(26.0));
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(10, 470), Eigen::Vector2d(600, 100)}) {
    EXPECT_NEAR((*camera.GroundFromPixel(pixel) - *ideal.GroundFromPixel(pixel)).norm(), 0.0, 1e-3);
  }
}

TEST(GroundCamera, RecordedCalibrationsAgreeWithTheirHeightAndTilt) {
  if (testing::SharedData().empty()) GTEST_SKIP() << testing::kNoSharedData;
  for (const auto& entry :
       std::filesystem::directory_iterator(testing::SharedData() / "sequences")) {
    const GroundCamera camera = GroundCamera::Load(entry.path() / "sequence.toml");
    // A pixel 20 degrees below the horizon is at height / tan(20 degrees), whatever the tilt.
    const double v =
        camera.cy + camera.fy * std::tan(RadiansFromDegrees(20.0) - camera.tilt_down_rad);
    const auto point = camera.GroundFromPixel({camera.cx, v});
    ASSERT_TRUE(point) << entry;
    EXPECT_NEAR(point->x() * std::tan(RadiansFromDegrees(20.0)) / camera.height_m, 1.0, 0.03)
        << entry;
  }
}

}  // namespace
}  // namespace beckon
