#include "tools/simulation/renderer.hpp"

#include <gmock/gmock.h>

#include <opencv2/imgproc.hpp>

#include "common/label_runs.hpp"
#include "tools/simulation/folders.hpp"

namespace beckon::simulation {
namespace {

// Small pictures and a coarse floor keep this quick; nothing tested here depends on either.
GroundCamera SmallCamera() { return DefaultCamera().Resized(160, 120); }
RenderOptions Quick() { return {.noise_sigma = 1.6, .texel_m = 0.01}; }

// Walks along the ray from the camera to the floor in small steps and asks whether it is inside
// anything.
bool MeetsSomething(const World& world, const Pose2& map_from_robot, double height_m,
                    const Eigen::Vector2d& ground) {
  const Eigen::Vector2d from = map_from_robot.translation();
  const Eigen::Vector2d to = map_from_robot * ground;
  const int steps = static_cast<int>((to - from).norm() / 0.004) + 1;
  for (int i = 0; i < steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    const Eigen::Vector2d point = (1.0 - t) * from + t * to;
    const double z = (1.0 - t) * height_m;
    for (const Solid& solid : world.solids) {
      if (z <= solid.height_m && (point - solid.centre).norm() <= solid.radius &&
          Distance(solid, point) <= 0.0) {
        return true;
      }
    }
  }
  return false;
}

TEST(Renderer, LabelsAgreeWithAWalkAlongEachRay) {
  const GroundCamera camera = SmallCamera();
  int wrong = 0;
  int not_ground = 0;
  int total = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const World world = MakeWorld(seed, {});
    Renderer renderer(world, camera, Quick());
    for (const double turn : {0.0, 2.0, 4.0}) {
      const Pose2 pose = world.map_from_robot * Pose2{0.0, 0.0, turn};
      cv::Mat labels;
      renderer.Render(pose, {}, 0, &labels);
      for (int v = 1; v < camera.height; v += 5) {
        for (int u = 1; u < camera.width; u += 5) {
          const auto ground = camera.GroundFromPixel({u, v});
          const bool is_ground = ground && ground->norm() < 20.0 &&
                                 !MeetsSomething(world, pose, camera.height_m, *ground);
          wrong += (labels.at<std::uint8_t>(v, u) == kGround) != is_ground;
          not_ground += !is_ground;
          ++total;
        }
      }
    }
  }
  EXPECT_GT(not_ground, total / 10);
  EXPECT_LT(wrong, total / 500);  // the walk steps over the thinnest corners
}

TEST(Renderer, PeopleStandInThePictureWhereTheyStandInTheFlat) {
  const GroundCamera camera = SmallCamera();
  const World world = MakeWorld(1, {});
  Renderer renderer(world, camera, Quick());
  const Pose2 pose = world.map_from_robot;
  const Eigen::Vector2d foot(1.0, 0.0);
  const Solid person =
      MakeCylinder("person", SolidKind::kPerson, pose * Eigen::Vector2d(1.0 + kPersonRadiusM, 0.0),
                   kPersonRadiusM, 1.7);
  cv::Mat without;
  cv::Mat with;
  renderer.Render(pose, {}, 0, &without);
  renderer.Render(pose, {person}, 0, &with);
  const Eigen::Vector2d pixel = *camera.PixelFromGround(foot);
  const int u = static_cast<int>(std::lround(pixel.x()));
  const int v = static_cast<int>(std::lround(pixel.y()));
  EXPECT_EQ(without.at<std::uint8_t>(v - 2, u), kGround);
  EXPECT_EQ(with.at<std::uint8_t>(v - 2, u), kNotGround);
  EXPECT_EQ(with.at<std::uint8_t>(v + 2, u), kGround);
}

TEST(Renderer, RepeatsAFrameExactlyAndDrawsNewNoiseForTheNext) {
  const World world = MakeWorld(2, {});
  const GroundCamera camera = SmallCamera();
  Renderer renderer(world, camera, Quick());
  Renderer again(world, camera, Quick());
  const cv::Mat first = renderer.Render(world.map_from_robot, {}, 0);
  EXPECT_EQ(cv::norm(first, again.Render(world.map_from_robot, {}, 0), cv::NORM_INF), 0.0);
  const cv::Mat second = renderer.Render(world.map_from_robot, {}, 1);
  cv::Mat difference;
  cv::subtract(first, second, difference, cv::noArray(), CV_32F);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(difference, mean, deviation);
  // Two independent draws of 1.6, and what rounding to whole levels adds.
  EXPECT_NEAR(deviation[1], 1.6 * std::numbers::sqrt2, 0.3);
}

// The floor's picture must stick to the floor: what is seen from one pose is where geometry says
// from another.
TEST(Renderer, FloorTextureMovesAsTheGroundHomographySays) {
  World world = MakeWorld(4, {});
  world.solids.erase(world.solids.begin() + 4, world.solids.end());  // outer walls only
  const GroundCamera camera = DefaultCamera();
  RenderOptions options;
  options.noise_sigma = 0.0;
  Renderer renderer(world, camera, options);
  const Eigen::Vector2d middle = 0.5 * (world.min + world.max);
  const Pose2 first_pose{middle.x(), middle.y(), 0.3};
  const Pose2 motion{0.05, 0.01, 0.03};
  cv::Mat first_labels;
  const cv::Mat first = renderer.Render(first_pose, {}, 0, &first_labels);
  const cv::Mat second = renderer.Render(first_pose * motion, {}, 1);
  double predicted = 0.0;
  double unmoved = 0.0;
  int count = 0;
  for (int v = 250; v < 460; v += 2) {
    for (int u = 60; u < 580; u += 2) {
      const Eigen::Vector2d before = motion * *camera.GroundFromPixel({u, v});
      const Eigen::Vector2d pixel = *camera.PixelFromGround(before);
      if (pixel.x() < 1.0 || pixel.y() < 1.0 || pixel.x() > 638.0 || pixel.y() > 478.0) continue;
      cv::Mat patch;
      cv::getRectSubPix(first, {1, 1},
                        {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())}, patch);
      predicted += std::abs(patch.at<cv::Vec3b>(0, 0)[1] - second.at<cv::Vec3b>(v, u)[1]);
      unmoved += std::abs(first.at<cv::Vec3b>(v, u)[1] - second.at<cv::Vec3b>(v, u)[1]);
      ++count;
    }
  }
  ASSERT_GT(count, 10000);
  EXPECT_LT(predicted / count, 0.3 * unmoved / count);
  EXPECT_GT(unmoved / count, 3.0);  // there is texture to be moved
}

}  // namespace
}  // namespace beckon::simulation
