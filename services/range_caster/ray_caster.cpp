#include "services/range_caster/ray_caster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/frames.hpp"
#include "common/label_runs.hpp"

namespace beckon {
namespace {

constexpr double kSampleStepPx = 0.75;
constexpr double kMaxBodyRotationRad = 0.35;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Pixels at even distances along the border of the picture.
std::vector<Eigen::Vector2d> BorderPixels(const GroundCamera& camera) {
  std::vector<Eigen::Vector2d> pixels;
  const double right = camera.width - 1.0;
  const double bottom = camera.height - 1.0;
  for (int u = 0; u < camera.width; ++u) {
    pixels.emplace_back(u, 0.0);
    pixels.emplace_back(u, bottom);
  }
  for (int v = 0; v < camera.height; ++v) {
    pixels.emplace_back(0.0, v);
    pixels.emplace_back(right, v);
  }
  return pixels;
}

// The part of the line start + t * direction, t >= 0, inside the box (Liang and Barsky).
struct Interval {
  double begin, end;
};
std::optional<Interval> ClipToBox(const Eigen::Vector2d& start, const Eigen::Vector2d& direction,
                                  const cv::Rect2d& box) {
  Interval inside{0.0, std::numeric_limits<double>::infinity()};
  const double low[] = {box.x, box.y};
  const double high[] = {box.x + box.width, box.y + box.height};
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(direction(axis)) < 1e-12) {
      if (start(axis) < low[axis] || start(axis) > high[axis]) return std::nullopt;
      continue;
    }
    const double a = (low[axis] - start(axis)) / direction(axis);
    const double b = (high[axis] - start(axis)) / direction(axis);
    inside.begin = std::max(inside.begin, std::min(a, b));
    inside.end = std::min(inside.end, std::max(a, b));
  }
  if (inside.begin > inside.end) return std::nullopt;
  return inside;
}

// Share of ground around a position between pixels, weighted by a Gaussian of one pixel: for a
// straight border it crosses one half just where the border is, whatever the border's slope.
double GroundShare(const cv::Mat& labels, double u, double v) {
  const int column = static_cast<int>(std::lround(u));
  const int row = static_cast<int>(std::lround(v));
  double ground = 0.0;
  double total = 0.0;
  for (int y = std::max(0, row - 2); y <= std::min(labels.rows - 1, row + 2); ++y) {
    const std::uint8_t* line = labels.ptr<std::uint8_t>(y);
    for (int x = std::max(0, column - 2); x <= std::min(labels.cols - 1, column + 2); ++x) {
      const double weight = std::exp(-0.5 * ((x - u) * (x - u) + (y - v) * (y - v)));
      total += weight;
      if (line[x] == kGround) ground += weight;
    }
  }
  return total > 0.0 ? ground / total : 0.0;
}

}  // namespace

void ReadRayCasterOptions(ConfigTable& table, RayCasterOptions& options) {
  table.Optional("bearing_step_deg", options.bearing_step_deg, Range{0.05, 5.0});
  table.Optional("max_range_m", options.max_range_m, Range{0.5, 100.0});
  table.Optional("max_pixel_span", options.max_pixel_span, Range{0.001, 1.0});
  table.Optional("max_hole_px", options.max_hole_px, Range{0, 8});
}

RayCaster::RayCaster(const GroundCamera& camera, const RayCasterOptions& options)
    : camera_(camera), options_(options) {
  // Lens distortion is only known where the picture is: far outside, its polynomial folds back.
  double min_u = 0.0, min_v = 0.0, max_u = 0.0, max_v = 0.0;
  double min_bearing = std::numeric_limits<double>::infinity();
  double max_bearing = -min_bearing;
  for (const Eigen::Vector2d& pixel : BorderPixels(camera_)) {
    const Eigen::Vector2d ideal = camera_.Undistorted(pixel);
    min_u = std::min(min_u, ideal.x());
    max_u = std::max(max_u, ideal.x());
    min_v = std::min(min_v, ideal.y());
    max_v = std::max(max_v, ideal.y());
    const auto ground = camera_.GroundFromPixel(ideal);
    if (!ground || ground->norm() > options_.max_range_m) continue;
    const double bearing = std::atan2(ground->y(), ground->x());
    min_bearing = std::min(min_bearing, bearing);
    max_bearing = std::max(max_bearing, bearing);
  }
  ideal_bounds_ = cv::Rect2d(min_u - 0.5, min_v - 0.5, max_u - min_u + 1.0, max_v - min_v + 1.0);
  const double step = RadiansFromDegrees(options_.bearing_step_deg);
  // Whole multiples of the step, so that one ray looks straight ahead.
  const int first = static_cast<int>(std::ceil(min_bearing / step));
  const int last = static_cast<int>(std::floor(max_bearing / step));
  if (!(min_bearing <= max_bearing) || last < first) {
    throw std::invalid_argument("the camera sees no ground within " +
                                std::to_string(options_.max_range_m) + " m");
  }
  first_bearing_rad_ = first * step;
  for (int i = first; i <= last; ++i) bearings_.push_back(i * step);

  level_fan_ = MakeFan(camera_);
  for (std::size_t ray = 0; ray < bearings_.size(); ++ray) {
    const bool visible = level_fan_.begin[ray] < level_fan_.begin[ray + 1];
    nearest_visible_m_.push_back(visible ? level_fan_.samples[level_fan_.begin[ray]].range_m
                                         : kNan);
  }
}

double RayCaster::PixelSpan(double range_m) const {
  const auto pixel = camera_.PixelFromGround({range_m, 0.0});
  if (!pixel) return std::numeric_limits<double>::infinity();
  const auto beyond = camera_.GroundFromPixel(*pixel - Eigen::Vector2d(0.0, 1.0));
  return beyond ? beyond->norm() - range_m : std::numeric_limits<double>::infinity();
}

RayCaster::Fan RayCaster::MakeFan(const GroundCamera& camera) const {
  Fan fan;
  fan.samples.reserve(std::max(level_fan_.samples.size(), bearings_.size() * 256));
  for (const double bearing : bearings_) {
    fan.begin.push_back(fan.samples.size());
    AppendRay(camera, bearing, fan.samples);
  }
  fan.begin.push_back(fan.samples.size());
  return fan;
}

void RayCaster::AppendRay(const GroundCamera& camera, double bearing_rad,
                          std::vector<Sample>& samples) const {
  // A straight line on the floor is a straight line in the ideal picture; it is walked there in
  // even steps, from the far end's pixel towards the near end and back out.
  const Eigen::Vector2d direction(std::cos(bearing_rad), std::sin(bearing_rad));
  const auto far_pixel = camera.PixelFromGround(options_.max_range_m * direction);
  const auto middle_pixel = camera.PixelFromGround(0.5 * options_.max_range_m * direction);
  if (!far_pixel || !middle_pixel) return;
  const Eigen::Vector2d towards_robot = (*middle_pixel - *far_pixel).normalized();
  const auto inside = ClipToBox(*far_pixel, towards_robot, ideal_bounds_);
  if (!inside) return;

  const int steps = static_cast<int>((inside->end - inside->begin) / kSampleStepPx);
  const std::size_t start = samples.size();
  for (int step = steps; step >= 0; --step) {
    const Eigen::Vector2d ideal =
        *far_pixel + (inside->begin + step * kSampleStepPx) * towards_robot;
    const auto ground = camera.GroundFromPixel(ideal);
    // Behind the robot: the line goes on past the point below the camera.
    if (!ground || ground->dot(direction) <= 0.0) continue;
    const Eigen::Vector2d pixel = camera.Distorted(ideal);
    const int column = static_cast<int>(std::lround(pixel.x()));
    const int row = static_cast<int>(std::lround(pixel.y()));
    if (column < 0 || column >= camera.width || row < 0 || row >= camera.height) {
      if (samples.size() > start) break;
      continue;
    }
    const double range = ground->norm();
    if (samples.size() > start &&
        range - samples.back().range_m > options_.max_pixel_span * kSampleStepPx * range) {
      break;
    }
    samples.push_back({static_cast<float>(pixel.x()), static_cast<float>(pixel.y()),
                       static_cast<float>(range), row * camera.width + column});
  }
}

bool RayCaster::IsLabelNoise(const cv::Mat& labels, int index) const {
  const int row = index / labels.cols;
  const int column = index % labels.cols;
  int others = 0;
  for (int y = std::max(0, row - 2); y <= std::min(labels.rows - 1, row + 2); ++y) {
    const std::uint8_t* line = labels.ptr<std::uint8_t>(y);
    for (int x = std::max(0, column - 2); x <= std::min(labels.cols - 1, column + 2); ++x) {
      if (line[x] != kGround && ++others > options_.max_hole_px) return false;
    }
  }
  return true;
}

double RayCaster::BorderRange(const cv::Mat& labels, const Sample* first, const Sample* last,
                              const Sample* hit) const {
  // The labels alone put the border between the two samples around it. The neighbourhood says where
  // between; it may not say more than about a pixel, lest it round off corners and thin legs.
  constexpr std::ptrdiff_t kReach = 2;  // samples
  const Sample* from = hit - std::min(kReach, hit - first);
  const Sample* to = hit + std::min(kReach - 1, last - 1 - hit);
  double share = GroundShare(labels, from->u, from->v);
  for (const Sample* sample = from; sample != to; ++sample) {
    const double next = GroundShare(labels, sample[1].u, sample[1].v);
    if (share >= 0.5 && next < 0.5) {
      const double part = (share - 0.5) / (share - next);
      return sample->range_m + part * (sample[1].range_m - sample->range_m);
    }
    share = next;
  }
  return 0.5 * (hit[-1].range_m + hit->range_m);
}

VirtualScan RayCaster::Cast(const cv::Mat& labels, double pitch_rad, double roll_rad) const {
  if (labels.type() != CV_8UC1 || labels.cols != camera_.width || labels.rows != camera_.height) {
    throw std::invalid_argument(
        "labels of " + std::to_string(labels.cols) + " x " + std::to_string(labels.rows) +
        " pixels, the camera is calibrated for " + std::to_string(camera_.width) + " x " +
        std::to_string(camera_.height));
  }
  if (!(std::abs(pitch_rad) <= kMaxBodyRotationRad && std::abs(roll_rad) <= kMaxBodyRotationRad)) {
    throw std::invalid_argument("body rotation of pitch " + std::to_string(pitch_rad) +
                                " rad, roll " + std::to_string(roll_rad) + " rad is not plausible");
  }
  const bool is_level = pitch_rad == 0.0 && roll_rad == 0.0;
  const Fan rocked_fan = is_level ? Fan{} : MakeFan(Rocked(camera_, pitch_rad, roll_rad));
  const Fan& fan = is_level ? level_fan_ : rocked_fan;

  VirtualScan scan;
  scan.first_bearing_rad = first_bearing_rad_;
  scan.bearing_step_rad = RadiansFromDegrees(options_.bearing_step_deg);
  scan.ranges_m.assign(bearings_.size(), kNan);
  scan.ground_seen_m.assign(bearings_.size(), 0.0F);
  const cv::Mat packed = labels.isContinuous() ? labels : labels.clone();
  const std::uint8_t* pixels = packed.ptr<std::uint8_t>();
  for (std::size_t ray = 0; ray < bearings_.size(); ++ray) {
    const Sample* first = fan.samples.data() + fan.begin[ray];
    const Sample* last = fan.samples.data() + fan.begin[ray + 1];
    if (first == last) continue;
    const Sample* hit = std::find_if(first, last, [&](const Sample& sample) {
      return pixels[sample.index] != kGround && !IsLabelNoise(packed, sample.index);
    });
    if (hit == last) {
      scan.ranges_m[ray] = kInfinity;
      scan.ground_seen_m[ray] = last[-1].range_m;
      continue;
    }
    const double border = hit == first ? hit->range_m : BorderRange(packed, first, last, hit);
    if (hit != first) scan.ground_seen_m[ray] = static_cast<float>(border);
    if (pixels[hit->index] == kNotGround) scan.ranges_m[ray] = static_cast<float>(border);
  }
  return scan;
}

}  // namespace beckon
