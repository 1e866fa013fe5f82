#include "tools/evaluation/navigation/truth_scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/label_runs.hpp"

namespace beckon {

TruthScanner::TruthScanner(const GroundCamera& camera, const ScanFaults& faults, std::uint64_t seed)
    : caster_(camera, {}),
      faults_(faults),
      open_floor_(caster_.Cast(cv::Mat(camera.height, camera.width, CV_8UC1, cv::Scalar(kGround)),
                               0.0, 0.0)),
      random_(seed) {}

TruthScanner::Block TruthScanner::DrawBlock(double rate) {
  const std::size_t rays = caster_.rays();
  const bool happens = uniform_(random_) < rate;
  const auto begin = static_cast<std::size_t>(uniform_(random_) * static_cast<double>(rays));
  const auto length = static_cast<std::size_t>(5.0 + 40.0 * uniform_(random_));
  return happens ? Block{begin, begin + length} : Block{rays, rays};
}

VirtualScan TruthScanner::Look(const std::function<double(double bearing_rad)>& range) {
  VirtualScan scan = open_floor_;
  const Block phantom = DrawBlock(faults_.phantom_rate);
  const double phantom_range = 0.5 + 2.5 * uniform_(random_);
  const Block blind = DrawBlock(faults_.blind_rate);
  for (std::size_t ray = 0; ray < scan.ranges_m.size(); ++ray) {
    if (blind.Contains(ray)) {
      scan.ranges_m[ray] = std::numeric_limits<float>::quiet_NaN();
      scan.ground_seen_m[ray] = 0.0F;
      continue;
    }
    double r = range(scan.Bearing(ray));
    if (std::isfinite(r)) {
      const double sd =
          faults_.range_noise * r +
          (faults_.pixel_noise > 0.0 ? faults_.pixel_noise * caster_.PixelSpan(r) : 0.0);
      r = std::max(0.0, r + sd * normal_(random_));
    }
    if (phantom.Contains(ray)) r = std::min(r, phantom_range);
    const double nearest = caster_.nearest_visible_m()[ray];
    if (r > open_floor_.ground_seen_m[ray]) continue;  // beyond the visible floor
    scan.ranges_m[ray] = static_cast<float>(std::max(r, nearest));
    scan.ground_seen_m[ray] = r <= nearest ? 0.0F : static_cast<float>(r);
  }
  return scan;
}

}  // namespace beckon
