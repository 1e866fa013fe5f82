// From "which pixels are ground" to "how far is it free": the virtual laser scanner of MonoVNS.
//
// Inverse perspective mapping after Lin and Song (National Chiao Tung University, MonoVNS): the
// calibrated homography takes the floor to the picture, so a ray over the floor is a list of pixels
// that is worked out once. The ray is followed from the robot outwards until the first pixel that
// is not ground.
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "common/config.hpp"
#include "common/ground_camera.hpp"

namespace beckon {

struct RayCasterOptions {
  double bearing_step_deg = 0.5;  // from ray to ray
  double max_range_m = 10.0;
  // Rays also end where one pixel spans more than this fraction of the range: beyond it, the
  // picture no longer says how far anything is.
  double max_pixel_span = 0.05;
  // As many pixels that are not ground, alone in ground, are noise of the labels and do not end a
  // ray.
  int max_hole_px = 2;
};

// Reads the keys of [range_caster] that belong to the rays.
void ReadRayCasterOptions(ConfigTable& table, RayCasterOptions& options);

// Rays over the floor from the origin of the robot frame, ray i at bearing first + i * step,
// counter-clockwise from robot x.
struct VirtualScan {
  double first_bearing_rad = 0.0;
  double bearing_step_rad = 0.0;
  // m, to the first thing that is not ground. inf: nothing within the visible ground (or the
  // maximum range). NaN: the ray ended in pixels about which nothing is known, or sees no floor at
  // all. Where the very first visible pixel is not ground, this is the range of that pixel: the
  // obstacle stands there or nearer.
  std::vector<float> ranges_m;
  // m, how far ground was seen along the ray without a break; 0 where none was. The floor nearer
  // than the picture's lower border is not seen, but a ray that starts with ground there counts
  // from the robot on.
  std::vector<float> ground_seen_m;

  double Bearing(std::size_t ray) const {
    return first_bearing_rad + static_cast<double>(ray) * bearing_step_rad;
  }
};

class RayCaster {
 public:
  // The rays fill the sector in which the camera sees any ground within the maximum range. Throws
  // std::invalid_argument when there is no such sector.
  RayCaster(const GroundCamera& camera, const RayCasterOptions& options);

  // `labels`: CV_8UC1 of the camera's size, values as GroundLabel. `pitch_rad` and `roll_rad`:
  // rotation of the body away from the calibrated pose, as in ground_t. Throws
  // std::invalid_argument for labels of another size or type, and for rotations that are not finite
  // or beyond 0.35 rad.
  VirtualScan Cast(const cv::Mat& labels, double pitch_rad, double roll_rad) const;

  std::size_t rays() const { return bearings_.size(); }
  // Range of the nearest visible ground along each ray of the level camera, m; NaN where the ray
  // sees none.
  const std::vector<float>& nearest_visible_m() const { return nearest_visible_m_; }
  // How much range one pixel is worth at this range straight ahead, m.
  double PixelSpan(double range_m) const;

 private:
  struct Sample {
    float u, v;     // position in the picture as taken, pixels
    float range_m;  // on the floor
    int index;      // of the nearest pixel, row-major
  };
  // Samples of all rays, each from near to far at steps below a pixel. Ray i has samples [begin[i],
  // begin[i + 1]).
  struct Fan {
    std::vector<Sample> samples;
    std::vector<std::size_t> begin;
  };

  Fan MakeFan(const GroundCamera& camera) const;
  void AppendRay(const GroundCamera& camera, double bearing_rad,
                 std::vector<Sample>& samples) const;
  bool IsLabelNoise(const cv::Mat& labels, int index) const;
  double BorderRange(const cv::Mat& labels, const Sample* first, const Sample* last,
                     const Sample* hit) const;

  GroundCamera camera_;
  RayCasterOptions options_;
  cv::Rect2d ideal_bounds_;  // of the undistorted picture
  double first_bearing_rad_ = 0.0;
  std::vector<double> bearings_;
  std::vector<float> nearest_visible_m_;
  Fan level_fan_;
};

}  // namespace beckon
