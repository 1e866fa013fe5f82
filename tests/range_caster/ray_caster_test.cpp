#include "services/range_caster/ray_caster.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "common/csv.hpp"
#include "common/frames.hpp"
#include "common/label_runs.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

GroundCamera TestCamera() {
  return GroundCamera::Pinhole(kWidth, kHeight, 532.0, 0.55, RadiansFromDegrees(26.0));
}

// What the camera sees of a floor on which `is_ground` holds, point by point; obstacles are flat,
// which is all that the nearest border of an obstacle needs. The camera may be distorted or rocked.
template <typename IsGround>
cv::Mat Picture(const GroundCamera& camera, IsGround is_ground) {
  cv::Mat labels(camera.height, camera.width, CV_8UC1);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const auto point = camera.GroundFromPixel(camera.Undistorted(Eigen::Vector2d(u, v)));
      labels.at<std::uint8_t>(v, u) = point && is_ground(*point) ? kGround : kNotGround;
    }
  }
  return labels;
}

std::size_t NearestRay(const VirtualScan& scan, double bearing_rad) {
  const double ray = (bearing_rad - scan.first_bearing_rad) / scan.bearing_step_rad;
  return static_cast<std::size_t>(
      std::clamp(std::lround(ray), 0L, static_cast<long>(scan.ranges_m.size()) - 1));
}

// Largest relative error against a wall x = `wall_x_m` over the rays within 25 degrees.
double WorstWallError(const VirtualScan& scan, double wall_x_m) {
  double worst = 0.0;
  for (std::size_t ray = 0; ray < scan.ranges_m.size(); ++ray) {
    if (std::abs(scan.Bearing(ray)) > RadiansFromDegrees(25.0)) continue;
    const double expected = wall_x_m / std::cos(scan.Bearing(ray));
    const double error = std::abs(scan.ranges_m[ray] - expected) / expected;
    worst = std::isnan(error) ? std::numeric_limits<double>::infinity() : std::max(worst, error);
  }
  return worst;
}

TEST(RayCaster, SectorFollowsFromTheCamera) {
  const GroundCamera camera = TestCamera();
  const RayCaster caster(camera, {});
  const VirtualScan scan =
      caster.Cast(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(kGround)), 0.0, 0.0);
  // The widest bearing is seen in the corner at the bottom of the picture.
  const Eigen::Vector2d corner = *camera.GroundFromPixel({0.0, kHeight - 1.0});
  const double widest = std::atan2(corner.y(), corner.x());
  EXPECT_NEAR(scan.first_bearing_rad, -widest, scan.bearing_step_rad);
  EXPECT_NEAR(scan.Bearing(scan.ranges_m.size() - 1), widest, scan.bearing_step_rad);
  EXPECT_LT(scan.bearing_step_rad, RadiansFromDegrees(1.0));
  // Straight ahead the nearest visible ground is at the bottom of the picture.
  const double nearest = camera.GroundFromPixel({camera.cx, kHeight - 1.0})->x();
  EXPECT_NEAR(caster.nearest_visible_m()[NearestRay(scan, 0.0)], nearest, 0.005);
}

TEST(RayCaster, EmptyFloorIsInfiniteAndSaysHowFarItWasSeen) {
  const RayCaster caster(TestCamera(), {});
  const VirtualScan scan =
      caster.Cast(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(kGround)), 0.0, 0.0);
  for (const float range : scan.ranges_m) EXPECT_EQ(range, std::numeric_limits<float>::infinity());
  EXPECT_GT(scan.ground_seen_m[NearestRay(scan, 0.0)], 8.0F);
  EXPECT_LE(scan.ground_seen_m[NearestRay(scan, 0.0)], 10.0F);
  // The outermost rays leave the picture at its side, where the ground is still near.
  EXPECT_LT(scan.ground_seen_m.front(), 1.0F);
  EXPECT_GT(scan.ground_seen_m.front(), 0.4F);
}

TEST(RayCaster, WallAheadIsAtItsDistance) {
  const GroundCamera camera = TestCamera();
  const RayCaster caster(camera, {});
  for (const double wall_x : {0.8, 1.37, 2.0, 3.3, 4.71, 6.0}) {
    const VirtualScan scan =
        caster.Cast(Picture(camera, [&](const auto& p) { return p.x() < wall_x; }), 0.0, 0.0);
    // Half a pixel, for a border parallel to the rows: nothing in the labels says more.
    EXPECT_LT(WorstWallError(scan, wall_x), 0.6 * caster.PixelSpan(wall_x) / wall_x + 1e-3)
        << wall_x;
    EXPECT_NEAR(scan.ground_seen_m[NearestRay(scan, 0.0)], scan.ranges_m[NearestRay(scan, 0.0)],
                1e-6);
  }
}

TEST(RayCaster, SlantedBorderIsFoundBelowAPixel) {
  const GroundCamera camera = TestCamera();
  const RayCaster caster(camera, {});
  // Wall through (2.5, 0) at 45 degrees to the line of sight's normal.
  const double slope = std::tan(RadiansFromDegrees(45.0));
  const VirtualScan scan = caster.Cast(
      Picture(camera, [&](const auto& p) { return p.x() < 2.5 + slope * p.y(); }), 0.0, 0.0);
  double sum = 0.0;
  int rays = 0;
  for (std::size_t ray = 0; ray < scan.ranges_m.size(); ++ray) {
    const double bearing = scan.Bearing(ray);
    if (std::abs(bearing) > RadiansFromDegrees(20.0)) continue;
    const double expected = 2.5 / (std::cos(bearing) - slope * std::sin(bearing));
    sum += std::abs(scan.ranges_m[ray] - expected) / caster.PixelSpan(expected);
    ++rays;
  }
  // Rounding to whole pixels would leave a quarter of a pixel.
  EXPECT_LT(sum / rays, 0.15);
}

TEST(RayCaster, NarrowObstacleStopsOnlyTheRaysThatMeetIt) {
  const GroundCamera camera = TestCamera();
  const RayCaster caster(camera, {});
  const Eigen::Vector2d centre(2.0, 0.4);
  const double radius = 0.02;
  const VirtualScan scan = caster.Cast(
      Picture(camera, [&](const auto& p) { return (p - centre).norm() > radius; }), 0.0, 0.0);
  const double bearing = std::atan2(centre.y(), centre.x());
  EXPECT_NEAR(scan.ranges_m[NearestRay(scan, bearing)], centre.norm() - radius, 0.03);
  EXPECT_TRUE(std::isinf(scan.ranges_m[NearestRay(scan, bearing + 0.03)]));
  EXPECT_TRUE(std::isinf(scan.ranges_m[NearestRay(scan, bearing - 0.03)]));
}

TEST(RayCaster, UndeterminedBorderGivesNoRangeButSaysWhatWasSeen) {
  const GroundCamera camera = TestCamera();
  const RayCaster caster(camera, {});
  cv::Mat labels = Picture(camera, [](const auto& p) { return p.x() < 2.0; });
  labels.setTo(kUndetermined, labels == kNotGround);
  const VirtualScan scan = caster.Cast(labels, 0.0, 0.0);
  const std::size_t ahead = NearestRay(scan, 0.0);
  EXPECT_TRUE(std::isnan(scan.ranges_m[ahead]));
  EXPECT_NEAR(scan.ground_seen_m[ahead], 2.0, 0.02);
}

TEST(RayCaster, ObstacleAtTheLowerBorderOfThePictureIsThereOrNearer) {
  const GroundCamera camera = TestCamera();
  const RayCaster caster(camera, {});
  const VirtualScan scan =
      caster.Cast(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(kNotGround)), 0.0, 0.0);
  for (std::size_t ray = 0; ray < scan.ranges_m.size(); ++ray) {
    EXPECT_FLOAT_EQ(scan.ranges_m[ray], caster.nearest_visible_m()[ray]);
    EXPECT_EQ(scan.ground_seen_m[ray], 0.0F);
  }
}

TEST(RayCaster, LabelNoiseDoesNotEndARayButAThinLegDoes) {
  const GroundCamera camera = TestCamera();
  const RayCaster caster(camera, {});
  cv::Mat labels(kHeight, kWidth, CV_8UC1, cv::Scalar(kGround));
  for (int v = 5; v < kHeight; v += 11) {
    for (int u = 3; u < kWidth; u += 13) labels.at<std::uint8_t>(v, u) = kNotGround;
  }
  const VirtualScan noisy = caster.Cast(labels, 0.0, 0.0);
  for (const float range : noisy.ranges_m) EXPECT_TRUE(std::isinf(range));

  labels.setTo(kGround);
  const int column = 320;
  labels(cv::Rect(column, 100, 1, 200)).setTo(kNotGround);  // one pixel wide, its foot in row 299
  const VirtualScan leg = caster.Cast(labels, 0.0, 0.0);
  const Eigen::Vector2d foot = *camera.GroundFromPixel({column, 299.5});
  EXPECT_NEAR(leg.ranges_m[NearestRay(leg, std::atan2(foot.y(), foot.x()))], foot.norm(), 0.02);
}

TEST(RayCaster, LensDistortionIsTakenOut) {
  GroundCamera camera = TestCamera();
  camera.distortion = {-0.28, 0.07, 0.0005, -0.0008, 0.0};
  const RayCaster caster(camera, {});
  const double wall_x = 2.5;
  const cv::Mat labels = Picture(camera, [&](const auto& p) { return p.x() < wall_x; });
  const double allowed = 0.8 * caster.PixelSpan(wall_x) / wall_x;
  EXPECT_LT(WorstWallError(caster.Cast(labels, 0.0, 0.0), wall_x), allowed);
  // The same picture taken for an ideal one is far off: the test would notice.
  GroundCamera ideal = camera;
  ideal.distortion = {};
  EXPECT_GT(WorstWallError(RayCaster(ideal, {}).Cast(labels, 0.0, 0.0), wall_x), 3.0 * allowed);
}

TEST(RayCaster, BodyRotationIsTakenOut) {
  const GroundCamera camera = TestCamera();
  const RayCaster caster(camera, {});
  const double wall_x = 3.0;
  const double pitch = RadiansFromDegrees(1.5);
  const double tilt = camera.tilt_down_rad + pitch;
  // For pitch alone there is an independent truth: a camera built with that tilt.
  const GroundCamera pitched =
      GroundCamera::Pinhole(kWidth, kHeight, camera.fx, camera.height_m, tilt);
  const cv::Mat labels = Picture(pitched, [&](const auto& p) { return p.x() < wall_x; });
  const double allowed = 0.8 * caster.PixelSpan(wall_x) / wall_x;
  EXPECT_LT(WorstWallError(caster.Cast(labels, pitch, 0.0), wall_x), allowed);
  EXPECT_GT(WorstWallError(caster.Cast(labels, 0.0, 0.0), wall_x), 3.0 * allowed);

  // Rolled clockwise as seen from behind, the right side sinks: floor on the right moves up in the
  // picture.
  const GroundCamera rolled = Rocked(camera, 0.0, RadiansFromDegrees(2.0));
  const Eigen::Vector2d right(2.0, -0.8);
  EXPECT_LT(rolled.PixelFromGround(right)->y(), camera.PixelFromGround(right)->y());
}

TEST(RayCaster, RefusesWhatIsNotItsCamerasPicture) {
  const RayCaster caster(TestCamera(), {});
  EXPECT_THROW(caster.Cast(cv::Mat(240, 320, CV_8UC1, cv::Scalar(1)), 0.0, 0.0),
               std::invalid_argument);
  EXPECT_THROW(caster.Cast(cv::Mat(kHeight, kWidth, CV_8UC3), 0.0, 0.0), std::invalid_argument);
  const cv::Mat labels(kHeight, kWidth, CV_8UC1, cv::Scalar(kGround));
  EXPECT_THROW(caster.Cast(labels, std::numeric_limits<double>::quiet_NaN(), 0.0),
               std::invalid_argument);
  EXPECT_THROW(caster.Cast(labels, 0.0, 1.0), std::invalid_argument);
  // A camera that looks at the sky.
  EXPECT_THROW(RayCaster(GroundCamera::Pinhole(kWidth, kHeight, 532.0, 50.0, 0.3), {}),
               std::invalid_argument);
}

// Recorded labels that are known to be right have to give the ranges that are known to be right.
TEST(RayCaster, TrueLabelsOfRecordedSequencesGiveTrueRanges) {
  const auto data = testing::SharedData();
  if (data.empty()) GTEST_SKIP() << testing::kNoSharedData;
  for (const std::string name : {"dev_office", "dev_hall", "dev_plain", "dev_approach"}) {
    const auto folder = data / "sequences" / name;
    RayCasterOptions options;
    options.bearing_step_deg = 0.1;  // so that the nearest ray is the true scan's, nearly
    const RayCaster caster(GroundCamera::Load(folder / "sequence.toml"), options);

    std::map<std::int64_t, std::vector<std::pair<double, double>>> truth;  // frame: bearing, range
    CsvReader scans(folder / "scans.csv", {"frame", "bearing_rad", "range_m"});
    while (scans.Next()) {
      if (scans.Integer(0) % 8 == 0)
        truth[scans.Integer(0)].emplace_back(scans.Number(1), scans.Number(2, true));
    }
    std::vector<double> errors;
    double bias = 0.0;
    int off = 0;
    for (const auto& [frame, rays] : truth) {
      char file[32];
      std::snprintf(file, sizeof(file), "%06d.png", static_cast<int>(frame));
      const VirtualScan scan =
          caster.Cast(cv::imread(folder / "truth" / file, cv::IMREAD_GRAYSCALE), 0.0, 0.0);
      for (const auto& [bearing, range] : rays) {
        if (range > 6.0) continue;
        const double measured = scan.ranges_m[NearestRay(scan, bearing)];
        const double error = (measured - range) / range;
        if (!(std::abs(error) <= 0.2)) {
          ++off;  // beside an edge, the next ray sees past it
        } else {
          errors.push_back(std::abs(error));
          bias += error;
        }
      }
    }
    ASSERT_GT(errors.size(), 200U) << name;
    bias /= static_cast<double>(errors.size());
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 0.005) << name;
    EXPECT_LT(errors[errors.size() * 95 / 100], 0.015) << name;
    EXPECT_LT(std::abs(bias), 0.003) << name;
    EXPECT_LT(off, static_cast<int>(errors.size()) / 50) << name;
  }
}

}  // namespace
}  // namespace beckon
