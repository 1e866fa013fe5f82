// A small world to look at: a textured floor, a wall at its end, and boxes on it, with exact
// labels.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "common/frames.hpp"
#include "common/ground_camera.hpp"

namespace beckon::testing {

struct Box {
  Eigen::Vector2d min;  // m, map frame
  Eigen::Vector2d max;
  double height_m = 0.3;
  cv::Vec3d bgr{40.0, 60.0, 180.0};
};

struct Scene {
  cv::Vec3d floor_bgr{120.0, 140.0, 150.0};
  double floor_contrast = 40.0;  // grey levels from dark to light
  bool floor_of_boards = false;  // texture across the y axis only
  double wall_x = 5.0;           // m, map frame
  cv::Vec3d wall_bgr{200.0, 190.0, 170.0};
  std::vector<Box> boxes;
  double noise = 2.0;  // standard deviation of the sensor's noise, grey levels
};

struct View {
  cv::Mat bgr;     // CV_8UC3
  cv::Mat labels;  // CV_8UC1, 1 ground, 2 not ground
};

// What the camera sees from there, on a body that leans. `seed`: of the sensor's noise.
View Render(const Scene& scene, const GroundCamera& camera, const Pose2& map_from_robot,
            unsigned seed, double pitch_rad = 0.0, double roll_rad = 0.0);

// The camera of these tests: 320 x 240, 0.5 m up, 22 degrees down.
GroundCamera TestCamera();

}  // namespace beckon::testing
