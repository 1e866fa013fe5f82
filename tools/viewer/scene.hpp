// One picture of all that the robot knows: the camera with the ground it sees, beside the map.
#pragma once

#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "beckon/ground_t.hpp"
#include "beckon/navigator_status_t.hpp"
#include "beckon/occupancy_grid_t.hpp"
#include "beckon/probability_map_t.hpp"
#include "bot_core/image_t.hpp"
#include "bot_core/planar_lidar_t.hpp"
#include "common/frames.hpp"
#include "common/robot_file.hpp"
#include "common/site.hpp"

namespace beckon {

// The newest message of each kind; whatever is missing is not drawn.
struct Scene {
  std::deque<bot_core::image_t>
      frames;  // oldest first, a few: the labels come later than their frame
  std::optional<ground_t> ground;
  std::optional<bot_core::planar_lidar_t> scan;
  std::optional<occupancy_grid_t> grid;
  std::optional<probability_map_t> possible_area;
  std::optional<navigator_status_t> status;
  std::optional<Pose2> map_from_robot;
  std::optional<Eigen::Vector2d> true_caller;  // m, map frame; known in simulation only
};

// 640 x 480 of camera, beside it a map of the same height and at most 640 wide. CV_8UC3.
cv::Mat DrawScene(const Site& site, const RobotOptions& robot, const Scene& scene);

}  // namespace beckon
