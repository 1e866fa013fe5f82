#include "services/range_caster/grid_mapper.hpp"

#include <algorithm>
#include <cmath>

namespace beckon {
namespace {

// What a scan says of a cell at close range, and where evidence saturates: about a second of ground
// seen undoes an obstacle, one phantom does not undo ground.
constexpr float kHit = 0.9F;
constexpr float kMiss = -0.5F;
// Scans that come faster than this are not independent of each other: errors of labels last for
// frames. Together they say what one would.
constexpr double kIndependentS = 0.1;
constexpr float kMaxLogOdds = 3.0F;
constexpr float kForgotten = 0.05F;

constexpr double kRecentreFraction = 1.0 / 8.0;  // of the grid's side
constexpr double kMotionWaitS = 0.3;
constexpr double kRestartS = 1.0;

}  // namespace

void ReadOccupancyMapOptions(ConfigTable& table, OccupancyMapOptions& options) {
  table.Optional("grid_resolution_m", options.resolution_m, Range{0.01, 0.5});
  table.Optional("grid_cells", options.cells, Range{16, 240});
  table.Optional("grid_memory_s", options.memory_s, Range{1.0, 3600.0});
}

OccupancyMap::OccupancyMap(const OccupancyMapOptions& options) : options_(options) {
  grid_.resolution_m = options.resolution_m;
  grid_.width = grid_.height = options.cells;
  const double middle = 0.5 * options.resolution_m * options.cells;
  grid_from_robot_ = {middle, middle, 0.0};
  log_odds_.assign(static_cast<std::size_t>(grid_.size()), 0.0F);
  evidence_.assign(static_cast<std::size_t>(grid_.size()), 0.0F);
}

void OccupancyMap::Move(const Pose2& old_robot_from_robot) {
  grid_from_robot_ = grid_from_robot_ * old_robot_from_robot;
  Recentre();
}

void OccupancyMap::Forget() { std::fill(log_odds_.begin(), log_odds_.end(), 0.0F); }

void OccupancyMap::Recentre() {
  const double side = grid_.resolution_m * grid_.width;
  const Eigen::Vector2d off =
      grid_from_robot_.translation() - Eigen::Vector2d::Constant(0.5 * side);
  if (off.cwiseAbs().maxCoeff() < kRecentreFraction * side) return;
  const int columns = static_cast<int>(std::lround(off.x() / grid_.resolution_m));
  const int rows = static_cast<int>(std::lround(off.y() / grid_.resolution_m));
  std::vector<float> shifted(log_odds_.size(), 0.0F);
  for (int row = 0; row < grid_.height; ++row) {
    for (int column = 0; column < grid_.width; ++column) {
      if (!grid_.Contains(column + columns, row + rows)) continue;
      shifted[static_cast<std::size_t>(grid_.Index(column, row))] =
          log_odds_[static_cast<std::size_t>(grid_.Index(column + columns, row + rows))];
    }
  }
  log_odds_ = std::move(shifted);
  grid_from_robot_.x -= columns * grid_.resolution_m;
  grid_from_robot_.y -= rows * grid_.resolution_m;
}

void OccupancyMap::Integrate(const VirtualScan& scan, const RayCaster& caster, double elapsed_s) {
  const auto keep = static_cast<float>(std::exp(-elapsed_s / options_.memory_s));
  for (float& cell : log_odds_) cell *= keep;

  const auto share = static_cast<float>(std::clamp(elapsed_s / kIndependentS, 0.0, 1.0));

  const double step = 0.5 * grid_.resolution_m;
  touched_.clear();
  // An obstacle outweighs ground in the same cell: its foot is part of the cell.
  const auto say = [&](int cell, float evidence) {
    if (cell < 0) return;
    float& said = evidence_[static_cast<std::size_t>(cell)];
    if (said == 0.0F) touched_.push_back(cell);
    if (said == 0.0F || evidence > said) said = evidence;
  };
  for (std::size_t ray = 0; ray < scan.ranges_m.size(); ++ray) {
    const double bearing = scan.Bearing(ray);
    const Eigen::Vector2d direction(std::cos(bearing), std::sin(bearing));
    const auto cell_at = [&](double range) {
      return grid_.IndexAt(grid_from_robot_ * Eigen::Vector2d(range * direction));
    };
    const double nearest = caster.nearest_visible_m()[ray];
    const double seen = scan.ground_seen_m[ray];
    const bool is_hit = std::isfinite(scan.ranges_m[ray]);

    // Up to one pixel (or cell) short of where the ground ends: the border itself is not certain.
    const double span = caster.PixelSpan(seen);
    const double free_end = seen - (is_hit ? std::max(span, grid_.resolution_m) : span);
    for (double range = nearest; range < free_end; range += step) {
      // A pixel that covers several cells says less about each.
      const double weight =
          1.0 / (1.0 + span * (range / seen) * (range / seen) / grid_.resolution_m);
      say(cell_at(range), static_cast<float>(weight) * kMiss);
    }

    for (double range = 0.0; range < nearest; range += step) {
      const int cell = cell_at(range);
      if (cell < 0) continue;
      const float known = log_odds_[static_cast<std::size_t>(cell)];
      // Anything tall between the robot and the picture's lower border would hide the ground beyond
      // it. Low things may stand there, so that what is known of them stays.
      if (seen > 0.0 && known <= 0.0F) say(cell, 0.5F * kMiss);
    }
    if (!is_hit) continue;
    // Not even the nearest visible pixel is ground: what stands there is nearer by nobody knows how
    // much, and often something that is known already.
    if (seen == 0.0) continue;
    const double range = scan.ranges_m[ray];
    const double weight = 1.0 / (1.0 + caster.PixelSpan(range) / grid_.resolution_m);
    say(cell_at(range + 0.5 * grid_.resolution_m), static_cast<float>(weight) * kHit);
  }
  for (const int cell : touched_) {
    float& evidence = evidence_[static_cast<std::size_t>(cell)];
    float& known = log_odds_[static_cast<std::size_t>(cell)];
    known = std::clamp(known + share * evidence, -kMaxLogOdds, kMaxLogOdds);
    evidence = 0.0F;
  }
}

std::vector<std::uint8_t> OccupancyMap::Occupancy() const {
  std::vector<std::uint8_t> occupancy(log_odds_.size());
  std::transform(log_odds_.begin(), log_odds_.end(), occupancy.begin(), [](float log_odds) {
    if (std::abs(log_odds) < kForgotten) return std::uint8_t{255};
    return static_cast<std::uint8_t>(std::lround(200.0F / (1.0F + std::exp(-log_odds))));
  });
  return occupancy;
}

void GridMapper::AddScan(Utime utime, VirtualScan scan) {
  const Utime newest = pending_.empty() ? utime_ : pending_.back().utime;
  if (utime <= newest) {
    // A frame out of order tells nothing that newer ones do not. Time that has gone back for good
    // does.
    if (utime > newest - UtimeFromSeconds(kRestartS)) return;
    map_.Forget();
    motion_.Clear();
    pending_.clear();
    utime_ = 0;
  }
  pending_.push_back({utime, std::move(scan)});
}

bool GridMapper::Update() {
  bool any = false;
  while (!pending_.empty()) {
    const Pending& next = pending_.front();
    const auto motion = utime_ == 0 ? std::optional(Pose2{}) : motion_.Between(utime_, next.utime);
    if (motion) {
      map_.Move(*motion);
    } else if (pending_.back().utime - next.utime > UtimeFromSeconds(kMotionWaitS)) {
      map_.Forget();
    } else {
      break;
    }
    // The first of all stands for itself.
    const double elapsed_s = utime_ == 0 ? kIndependentS : SecondsFromUtime(next.utime - utime_);
    map_.Integrate(next.scan, caster_, elapsed_s);
    utime_ = next.utime;
    pending_.pop_front();
    any = true;
  }
  return any;
}

}  // namespace beckon
