#include "services/rssi_localizer/scan_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace beckon {
namespace {

constexpr double kBinM = 0.05;
constexpr double kReachSd = 4.0;  // beyond so many standard deviations nothing changes

double NormalDensity(double x, double sd) {
  return std::exp(-0.5 * x * x / (sd * sd)) / (sd * std::sqrt(2.0 * std::numbers::pi));
}
double NormalUpTo(double x, double sd) { return 0.5 * std::erfc(-x / (sd * std::numbers::sqrt2)); }

void Check(const RangeScan& scan) {
  const std::size_t rays = scan.ranges_m.size();
  if (rays < 2 || rays > 20'000 || scan.ground_seen_m.size() != rays) {
    throw std::invalid_argument("a scan of that many rays, or with fewer intensities than ranges");
  }
  if (!std::isfinite(scan.first_bearing_rad) || !std::isfinite(scan.bearing_step_rad)) {
    throw std::invalid_argument("a scan with bearings that are not finite");
  }
  const auto is_negative = [](float value) { return value < 0.0F; };
  if (std::any_of(scan.ranges_m.begin(), scan.ranges_m.end(), is_negative) ||
      !std::all_of(scan.ground_seen_m.begin(), scan.ground_seen_m.end(),
                   [](float value) { return value >= 0.0F && std::isfinite(value); })) {
    throw std::invalid_argument("a scan with a range that cannot be");
  }
}

}  // namespace

ScanModel::ScanModel(const FloorPlan& plan, const ScanModelOptions& options)
    : options_(options), field_(plan) {}

// Density over the range for a ray that met something, probability for one that did not, or that
// met something nearer than the floor it can see.
double ScanModel::RayLikelihood(double range_m, double seen_m, double wall_m) const {
  const double through = options_.through_wall;
  const double unmapped = options_.unmapped;
  const double wall = 1.0 - through - unmapped;
  const double mean = options_.unmapped_mean_m;
  const bool has_wall = std::isfinite(wall_m);
  const double sd =
      std::hypot(options_.wall_sd_m, options_.wall_sd_per_m * (has_wall ? wall_m : 0.0));
  // Of things not on the plan, the share before the wall: the others are hidden by it.
  const double before_wall = has_wall ? 1.0 - std::exp(-wall_m / mean) : 1.0;
  const double through_density = through / options_.max_range_m;
  const auto met_by = [&](double r) {  // probability that the ray has ended by the range r
    const double thing = unmapped * std::min(1.0 - std::exp(-r / mean), before_wall);
    const double rest = 1.0 - through - unmapped * before_wall;
    return thing + (has_wall ? rest * NormalUpTo(r - wall_m, sd) : 0.0) + through_density * r;
  };
  if (!std::isfinite(range_m)) return std::max(1.0 - met_by(seen_m), through_density);
  if (seen_m <= 0.0) return std::max(met_by(range_m), through_density);
  const double rest = wall + unmapped * (1.0 - before_wall);
  double density = through_density;
  if (has_wall) density += rest * NormalDensity(range_m - wall_m, sd);
  if (range_m < wall_m) density += unmapped * std::exp(-range_m / mean) / mean;
  return density;
}

ScanModel::View ScanModel::Prepare(const RangeScan& scan) const {
  Check(scan);
  View view;
  const std::size_t rays = scan.ranges_m.size();
  const std::size_t wanted = std::min(rays, static_cast<std::size_t>(options_.rays));
  const auto all_bins = static_cast<std::size_t>(options_.max_range_m / kBinM);
  for (std::size_t i = 0; i < wanted; ++i) {
    const std::size_t ray = (2 * i + 1) * rays / (2 * wanted);
    const double range = scan.ranges_m[ray];
    const double seen = scan.ground_seen_m[ray];
    if (std::isnan(range) || (std::isinf(range) && seen <= 0.0)) continue;
    const double end = std::isfinite(range) ? range : seen;
    const double sd = std::hypot(options_.wall_sd_m, options_.wall_sd_per_m * end);
    const double bearing =
        scan.first_bearing_rad + static_cast<double>(ray) * scan.bearing_step_rad;
    View::Ray prepared;
    prepared.direction = Eigen::Vector2d(std::cos(bearing), std::sin(bearing)).cast<float>();
    prepared.longest_m =
        static_cast<float>(std::min(options_.max_range_m, end + 2.0 * kReachSd * sd));
    const auto bins = std::min(all_bins, static_cast<std::size_t>(prepared.longest_m / kBinM) + 1);
    for (std::size_t bin = 0; bin < bins; ++bin) {
      const double wall = (static_cast<double>(bin) + 0.5) * kBinM;
      prepared.log_likelihood.push_back(
          static_cast<float>(options_.trust * std::log(RayLikelihood(range, seen, wall))));
    }
    prepared.log_likelihood.push_back(static_cast<float>(
        options_.trust *
        std::log(RayLikelihood(range, seen, std::numeric_limits<double>::infinity()))));
    view.rays_.push_back(std::move(prepared));
  }
  return view;
}

double ScanModel::LogLikelihood(const View& view, const Pose2& map_from_robot) const {
  const Eigen::Vector2f from = map_from_robot.translation().cast<float>();
  const auto c = static_cast<float>(std::cos(map_from_robot.theta));
  const auto s = static_cast<float>(std::sin(map_from_robot.theta));
  float sum = 0.0F;
  for (const View::Ray& ray : view.rays_) {
    const Eigen::Vector2f direction(c * ray.direction.x() - s * ray.direction.y(),
                                    s * ray.direction.x() + c * ray.direction.y());
    const float wall = field_.Range(from, direction, ray.longest_m);
    const std::size_t no_wall = ray.log_likelihood.size() - 1;
    const std::size_t bin =
        std::isfinite(wall)
            ? std::min(no_wall, static_cast<std::size_t>(wall / static_cast<float>(kBinM)))
            : no_wall;
    sum += ray.log_likelihood[bin];
  }
  return sum;
}

}  // namespace beckon
