// What the robot's camera sees of a world, with the truth about each pixel.
//
// Everything that stands is a vertical prism or cylinder, so a pixel's ray is traced in the plane:
// its azimuth picks the few things that lie that way, its slope tells which of them it meets and
// whether it comes down to the floor before. Pixels in which surfaces meet are traced several
// times; surfaces are filtered to the area that a pixel covers.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/ground_camera.hpp"
#include "tools/simulation/texture.hpp"
#include "tools/simulation/world.hpp"

namespace beckon::simulation {

struct RenderOptions {
  double noise_sigma = 1.6;  // of each channel, grey levels
  double texel_m = 0.0025;   // of the floor's picture
  // Floor, walls and furniture all look like this, in the same light and without shadows: colour
  // and brightness then say nothing about what is floor.
  std::optional<Look> one_look = std::nullopt;
};

class Renderer {
 public:
  // Paints the floor once, which takes about a second for a large flat. The camera is taken as a
  // pinhole camera with its height, tilt, focal lengths and distortion, above the robot frame's
  // origin.
  Renderer(const World& world, const GroundCamera& camera, const RenderOptions& options);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  // The picture (CV_8UC3, BGR) from this pose, with people standing there. `frame` picks the noise.
  // Where `labels` is given it becomes the truth at each pixel's centre (CV_8UC1: GroundLabel
  // kGround, kNotGround).
  cv::Mat Render(const Pose2& map_from_robot, const std::vector<Solid>& people, std::uint64_t frame,
                 cv::Mat* labels = nullptr);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace beckon::simulation
