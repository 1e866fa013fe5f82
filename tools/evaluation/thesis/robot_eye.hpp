// A simulated camera whose pictures go the way of a real one's: noise, JPEG, decoding.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/ground_camera.hpp"
#include "tools/simulation/renderer.hpp"

namespace beckon {

struct View {
  cv::Mat bgr;    // CV_8UC3, as a service decodes it
  cv::Mat truth;  // CV_8UC1, GroundLabel of each pixel
  double decode_ms = 0.0;
};

class RobotEye {
 public:
  RobotEye(const simulation::World& world, const GroundCamera& camera,
           const simulation::RenderOptions& options)
      : renderer_(world, camera, options) {}
  View Look(const Pose2& map_from_robot);

 private:
  simulation::Renderer renderer_;
  std::uint64_t frame_ = 0;
};

// A room without furniture, people or beacons: its walls, 2.6 m high, are solids. `open_back`: the
// wall at the smallest x is left out.
simulation::World BareRoom(std::uint64_t seed, const Eigen::Vector2d& min,
                           const Eigen::Vector2d& max, bool open_back);

// Creates the folder where needed. Throws FileError where the picture cannot be written.
void SavePicture(const std::filesystem::path& folder, const std::string& name,
                 const cv::Mat& picture);

}  // namespace beckon
