#include "services/navigator/surroundings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace beckon {
namespace {

constexpr double kWindowSideM = 8.0;
constexpr double kResolutionM = 0.05;
constexpr double kRedrawAfterM = 1.0;
constexpr std::uint8_t kFreeUpTo = 90;  // 45 %
constexpr double kNothingNearM = 10.0;
// The floor under the robot and a little round it counts as seen: it stands there.
constexpr double kOwnPlaceM = 0.12;
// By so much the clearance may seem to shrink along a way that keeps it.
constexpr double kSlackM = 0.005;
constexpr double kTouchM = 0.01;

// Unit vectors from 80 degrees right to 80 degrees left of ahead.
const std::array<Eigen::Vector2d, 9> kLeadingRim = [] {
  std::array<Eigen::Vector2d, 9> rim;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const double angle = RadiansFromDegrees(20.0 * static_cast<double>(i) - 80.0);
    rim[i] = {std::cos(angle), std::sin(angle)};
  }
  return rim;
}();

// Along a way that starts at this clearance. What is nearer than the margin already may be passed,
// but not come nearer to; a way that seems to keep its distance must not add up to a touch.
double NeededClearance(double at_start_m, double radius_m, double margin_m) {
  const double nearest = radius_m + kTouchM;
  if (at_start_m <= nearest) return at_start_m;
  return std::min(radius_m + margin_m, std::max(nearest, at_start_m - kSlackM));
}

}  // namespace

void Surroundings::SetGrid(SeenGrid grid, const Pose2& local_from_robot) {
  local_from_grid_ = local_from_robot * grid.grid_from_robot.Inverse();
  grid_ = std::move(grid);
  is_changed_ = true;
}

void Surroundings::SetScan(Scan scan, const Pose2& local_from_robot) {
  scan_ = std::move(scan);
  local_from_scan_ = local_from_robot;
  is_changed_ = true;
}

void Surroundings::Clear() {
  grid_.reset();
  scan_.reset();
  is_changed_ = true;
}

void Surroundings::Update(const Pose2& local_from_base) {
  const double half = 0.5 * kWindowSideM;
  const Eigen::Vector2d middle = window_.origin + Eigen::Vector2d::Constant(half);
  const bool has_left =
      window_.size() == 0 || (local_from_base.translation() - middle).norm() > kRedrawAfterM;
  if (!is_changed_ && !has_left) return;
  is_changed_ = false;
  // Whole cells, so that obstacles do not change shape with the robot's motion.
  const Eigen::Vector2d corner = local_from_base.translation() - Eigen::Vector2d::Constant(half);
  window_.resolution_m = kResolutionM;
  window_.origin = kResolutionM * (corner / kResolutionM).array().floor().matrix();
  window_.width = window_.height = static_cast<int>(kWindowSideM / kResolutionM);
  seen_ = cv::Mat(window_.height, window_.width, CV_8UC1, cv::Scalar(0));
  obstacles_ = cv::Mat(window_.height, window_.width, CV_8UC1, cv::Scalar(255));
  if (grid_) DrawGrid();
  if (scan_) DrawScan(local_from_base);

  // The cells round an obstacle are never sure to be free. It is what tells how near one may come
  // there.
  cv::Mat not_near_obstacle;
  cv::erode(obstacles_, not_near_obstacle, cv::Mat());
  seen_.setTo(255, not_near_obstacle == 0);
  // A cell that is partly floor counts as seen, even if the rest of it is something that was not:
  // the border of what was seen does not count.
  cv::erode(seen_, seen_, cv::Mat());

  if (cv::countNonZero(obstacles_) == window_.size()) {
    clearance_ = cv::Mat(window_.height, window_.width, CV_32FC1, cv::Scalar(kNothingNearM));
  } else {
    cv::distanceTransform(obstacles_, clearance_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    // To the near side of the cell, not to its middle.
    clearance_ = kResolutionM * clearance_ - 0.5 * kResolutionM;
  }
}

void Surroundings::DrawGrid() {
  const Pose2 grid_from_local = local_from_grid_.Inverse();
  for (int row = 0; row < window_.height; ++row) {
    for (int column = 0; column < window_.width; ++column) {
      const int cell = grid_->grid.IndexAt(grid_from_local * window_.Centre(column, row));
      if (cell < 0) continue;
      const std::uint8_t occupancy = grid_->occupancy[static_cast<std::size_t>(cell)];
      if (occupancy >= SeenGrid::kOccupiedFrom && occupancy != SeenGrid::kUnknown)
        obstacles_.at<std::uint8_t>(row, column) = 0;
      if (occupancy <= kFreeUpTo) seen_.at<std::uint8_t>(row, column) = 255;
    }
  }
}

void Surroundings::MarkOccupied(const Eigen::Vector2d& point) {
  const int column = window_.Column(point.x());
  const int row = window_.Row(point.y());
  if (window_.Contains(column, row)) obstacles_.at<std::uint8_t>(row, column) = 0;
}

// Whether something that is known stands along this direction of the scan within the range.
bool Surroundings::IsExplained(const Eigen::Vector2d& direction, double range_m) const {
  for (double range = 0.0; range < range_m + kResolutionM; range += 0.5 * kResolutionM) {
    const Eigen::Vector2d point = local_from_scan_ * Eigen::Vector2d(range * direction);
    const int column = window_.Column(point.x());
    const int row = window_.Row(point.y());
    if (window_.Contains(column, row) && obstacles_.at<std::uint8_t>(row, column) == 0) return true;
  }
  return false;
}

void Surroundings::DrawScan(const Pose2& local_from_base) {
  for (std::size_t ray = 0; ray < scan_->ranges_m.size(); ++ray) {
    const double bearing = scan_->Bearing(ray);
    const Eigen::Vector2d direction(std::cos(bearing), std::sin(bearing));
    const double seen = scan_->ground_seen_m[ray];
    for (double range = 0.0; range < seen; range += 0.5 * kResolutionM) {
      const Eigen::Vector2d point = local_from_scan_ * Eigen::Vector2d(range * direction);
      const int column = window_.Column(point.x());
      const int row = window_.Row(point.y());
      if (!window_.Contains(column, row)) break;
      seen_.at<std::uint8_t>(row, column) = 255;
    }
    const double range = scan_->ranges_m[ray];
    if (!std::isfinite(range)) continue;
    if (seen > 0.0) {
      MarkOccupied(local_from_scan_ * Eigen::Vector2d((range + 0.5 * kResolutionM) * direction));
    } else if (!IsExplained(direction, range)) {
      // It stands at this range or anywhere nearer, outside the robot: the nearest place is the one
      // to reckon with.
      MarkOccupied(local_from_scan_ * Eigen::Vector2d(range * direction));
      for (double nearer = 0.0; nearer < range; nearer += kResolutionM) {
        const Eigen::Vector2d point = local_from_scan_ * Eigen::Vector2d(nearer * direction);
        if ((point - local_from_base.translation()).norm() < robot_.radius_m + kResolutionM)
          continue;
        MarkOccupied(point);
        break;
      }
    }
  }
}

double Surroundings::Clearance(const Eigen::Vector2d& point) const {
  // Between the four cell centres around the point; a value per cell would jump by centimetres.
  const Eigen::Vector2d cell =
      (point - window_.origin) / kResolutionM - Eigen::Vector2d::Constant(0.5);
  const int column = static_cast<int>(std::floor(cell.x()));
  const int row = static_cast<int>(std::floor(cell.y()));
  if (!window_.Contains(column, row) || !window_.Contains(column + 1, row + 1)) return 0.0;
  const double right = cell.x() - column;
  const double up = cell.y() - row;
  const auto* lower = clearance_.ptr<float>(row) + column;
  const auto* upper = clearance_.ptr<float>(row + 1) + column;
  return (1.0 - up) * ((1.0 - right) * lower[0] + right * lower[1]) +
         up * ((1.0 - right) * upper[0] + right * upper[1]);
}

bool Surroundings::IsSeen(const Eigen::Vector2d& point) const {
  const int column = window_.Column(point.x());
  const int row = window_.Row(point.y());
  return window_.Contains(column, row) && seen_.at<std::uint8_t>(row, column) != 0;
}

bool Surroundings::IsObstructed(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  const int steps = static_cast<int>(std::ceil((to - from).norm() / kResolutionM));
  for (int i = 1; i <= steps; ++i) {
    const Eigen::Vector2d point = from + (to - from) * (static_cast<double>(i) / steps);
    if (Clearance(point) < kResolutionM) return true;
  }
  return false;
}

double Surroundings::NearestInScan(const Pose2& local_from_base) const {
  double nearest = std::numeric_limits<double>::infinity();
  if (!scan_) return nearest;
  for (std::size_t ray = 0; ray < scan_->ranges_m.size(); ++ray) {
    const double range = scan_->ranges_m[ray];
    if (!std::isfinite(range)) continue;
    const double bearing = scan_->Bearing(ray);
    const Eigen::Vector2d point =
        local_from_scan_ * Eigen::Vector2d(range * std::cos(bearing), range * std::sin(bearing));
    nearest = std::min(nearest, (point - local_from_base.translation()).norm());
  }
  return nearest;
}

ArcView LookAlong(const Surroundings& surroundings, const RobotOptions& robot,
                  const Pose2& local_from_base, double curvature_per_m, int direction,
                  double length_m, double margin_m) {
  const double at_start = surroundings.Clearance(local_from_base.translation());
  const double needed = NeededClearance(at_start, robot.radius_m, margin_m);
  ArcView view{length_m, length_m, at_start - robot.radius_m};
  const double rim_m = robot.radius_m + margin_m;
  Pose2 pose = local_from_base;
  const double step = 0.5 * kResolutionM;
  for (double way = step; way <= length_m; way += step) {
    // Middle of the arc's piece: exact enough at steps of centimetres.
    const double heading = pose.theta + 0.5 * direction * step * curvature_per_m;
    pose.x += direction * step * std::cos(heading);
    pose.y += direction * step * std::sin(heading);
    pose.theta += direction * step * curvature_per_m;

    const double clearance = surroundings.Clearance(pose.translation());
    if (clearance < needed) view.free_m = std::min(view.free_m, way - step);
    view.clearance_m = std::min(view.clearance_m, clearance - robot.radius_m);

    // The leading half of the rim is what comes to new floor.
    for (const Eigen::Vector2d& direction_on_rim : kLeadingRim) {
      const Eigen::Vector2d rim = pose * Eigen::Vector2d(direction * rim_m * direction_on_rim);
      if ((rim - local_from_base.translation()).norm() < robot.radius_m + kOwnPlaceM) continue;
      if (!surroundings.IsSeen(rim)) view.seen_m = std::min(view.seen_m, way - step);
    }
    if (view.free_m < way && view.seen_m < way) break;
  }
  return view;
}

}  // namespace beckon
