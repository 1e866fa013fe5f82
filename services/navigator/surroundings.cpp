#include "services/navigator/surroundings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace beckon {
namespace {

constexpr double kWindowSideM = 7.0;
constexpr double kResolutionM = 0.025;
constexpr double kMoveWindowM = 1.0;
constexpr std::uint8_t kFreeUpTo = 90;  // 45 %
// Nearer to the robot than a route is planned, what is in doubt is no floor: corners fade first.
constexpr std::uint8_t kDoubtfulFrom = 115;  // 57 %
constexpr double kNothingNearM = 10.0;
// How long things hold that GRID does not know.
constexpr double kStandS = 20.0;
constexpr double kSightS = 8.0;
// Something too near for the camera holds a second longer with each scan that shows it: it outlasts
// the robot's turning away, and one phantom does not.
constexpr double kHiddenPerScanS = 1.0;
constexpr double kHiddenS = 10.0;  // at most
constexpr double kGridTimeoutS = 2.0;
// A robot that has not moved by as much for so long is one that people step up to.
constexpr double kStillM = 0.01;
constexpr double kStillRad = 0.02;
constexpr float kStandingS = 1.0F;
constexpr double kStepUpM = 0.5;  // they stand within this of its rim
// Having looked, it may wait for this and that, until it is elsewhere or some time has passed.
constexpr double kElsewhereM = 0.3;
constexpr float kLookedS = 20.0F;
// Floor this near to an obstacle is never sure to be free. It is the obstacle that tells how near
// one may come there.
constexpr int kBesideObstacleCells = 4;
// What is known to stand this near to a ray may be what the ray met: places err by so much.
constexpr int kSameObstacleCells = 3;
// The border of what was seen does not count: a cell that is partly floor is called free.
constexpr int kBorderCells = 2;
// By so much the clearance may seem to shrink along a way that keeps it.
constexpr double kSlackM = 0.005;
constexpr double kTouchM = 0.03;
// Of the cells, in which OpenCV draws.
constexpr int kFractionBits = 8;
constexpr double kFractions = 1 << kFractionBits;
int Fractions(double metres) {
  return static_cast<int>(std::lround(kFractions * metres / kResolutionM));
}

// Unit vectors from 65 degrees right and left of ahead to ahead: what lies outermost is looked at
// first, and the rest is seen on the way. Farther aside the rim with its margin sweeps nothing that
// the disc itself would touch.
const std::array<Eigen::Vector2d, 9> kLeadingRim = [] {
  constexpr double kOutermostRad = RadiansFromDegrees(65.0);
  std::array<Eigen::Vector2d, 9> rim;
  for (int i = 0; i < 9; ++i) {
    const double angle = (i % 2 == 0 ? 1.0 : -1.0) * kOutermostRad * (1.0 - 0.25 * (i / 2));
    rim[static_cast<std::size_t>(i)] = {std::cos(angle), std::sin(angle)};
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

void Surroundings::SetGrid(Instant now, SeenGrid grid, const Pose2& local_from_robot) {
  grid_at_ = now;
  local_from_grid_ = local_from_robot * grid.grid_from_robot.Inverse();
  grid_ = std::move(grid);
  is_grid_drawn_ = false;
  is_changed_ = true;
}

void Surroundings::SetScan(Scan scan, const Pose2& local_from_robot) {
  scan_ = std::move(scan);
  local_from_scan_ = local_from_robot;
  is_scan_new_ = true;
  is_changed_ = true;
}

void Surroundings::DropGrid() {
  grid_.reset();
  is_grid_drawn_ = false;
  is_changed_ = true;
}

void Surroundings::Clear() {
  grid_.reset();
  scan_.reset();
  movers_.Clear();
  doubted_at_s_.reset();
  window_ = {};  // all layers begin anew
}

void Surroundings::MoveWindow(const Eigen::Vector2d& middle) {
  const int cells = static_cast<int>(std::lround(kWindowSideM / kResolutionM));
  const GridGeometry old = window_;
  // Whole cells, so that things do not change shape with the robot's motion.
  const Eigen::Vector2d corner = middle - Eigen::Vector2d::Constant(0.5 * kWindowSideM);
  window_.resolution_m = kResolutionM;
  window_.origin = kResolutionM * (corner / kResolutionM).array().floor().matrix();
  window_.width = window_.height = cells;
  const auto move = [&](int type, cv::Mat* layer) {
    cv::Mat moved(cells, cells, type, cv::Scalar(0.0));
    if (old.size() > 0) {
      const Eigen::Vector2d by = (window_.origin - old.origin) / kResolutionM;
      const cv::Rect whole(0, 0, cells, cells);
      const cv::Point shift(static_cast<int>(std::lround(by.x())),
                            static_cast<int>(std::lround(by.y())));
      const cv::Rect kept = whole & (whole + shift);
      if (!kept.empty()) (*layer)(kept).copyTo(moved(kept - shift));
    }
    *layer = moved;
  };
  move(CV_32FC1, &seen_until_);
  move(CV_32FC1, &hidden_until_);
  move(CV_8UC1, &doubted_);
}

void Surroundings::Update(Instant now, const Pose2& local_from_base) {
  if (!began_) began_ = now;
  now_s_ = static_cast<float>(SecondsSince(now, *began_));
  base_ = local_from_base.translation();
  if (grid_ && SecondsSince(now, grid_at_) > kGridTimeoutS) DropGrid();
  const Eigen::Vector2d middle = window_.origin + Eigen::Vector2d::Constant(0.5 * kWindowSideM);
  if (window_.size() == 0 || (base_ - middle).norm() > kMoveWindowM) {
    MoveWindow(base_);
    is_grid_drawn_ = false;
    is_changed_ = true;
  }
  DoubtFloorBesideStandingRobot(local_from_base);
  AddStand();
  if (!is_changed_) return;
  is_changed_ = false;
  if (!is_grid_drawn_) DrawGrid();
  seen_ = (grid_seen_ & ~doubted_) | (seen_until_ > now_s_);
  grid_obstacles_.copyTo(obstacles_);
  if (scan_) AddScan();
  obstacles_.setTo(0, hidden_until_ > now_s_);

  cv::Mat far_from_obstacles;
  cv::erode(obstacles_, far_from_obstacles, cv::Mat(), {-1, -1}, kBesideObstacleCells);
  seen_.setTo(255, far_from_obstacles == 0);
  cv::erode(seen_, seen_, cv::Mat(), {-1, -1}, kBorderCells);

  if (cv::countNonZero(obstacles_) == window_.size()) {
    clearance_ = cv::Mat(window_.height, window_.width, CV_32FC1, cv::Scalar(kNothingNearM));
  } else {
    cv::distanceTransform(obstacles_, clearance_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    // To the near side of the cell, not to its middle.
    clearance_ = kResolutionM * clearance_ - 0.5 * kResolutionM;
  }
}

void Surroundings::DoubtFloorBesideStandingRobot(const Pose2& local_from_base) {
  const Pose2 moved = stands_at_.Inverse() * local_from_base;
  if (moved.translation().norm() > kStillM || std::abs(moved.theta) > kStillRad) {
    stands_at_ = local_from_base;
    stands_since_s_ = now_s_;
  }
  const bool has_doubted = doubted_at_s_ && now_s_ - *doubted_at_s_ < kLookedS &&
                           (base_ - doubted_from_).norm() < kElsewhereM;
  if (has_doubted || now_s_ - stands_since_s_ < kStandingS) return;
  doubted_at_s_ = now_s_;
  doubted_from_ = base_;
  is_changed_ = true;
  cv::circle(doubted_, Pixel(base_), Fractions(robot_.radius_m + kStepUpM), cv::Scalar(255),
             cv::FILLED, cv::LINE_8, kFractionBits);
  seen_until_.setTo(0.0, doubted_);
}

void Surroundings::AddStand() {
  cv::Mat stand(window_.height, window_.width, CV_32FC1, cv::Scalar(0.0));
  cv::circle(stand, Pixel(base_), Fractions(robot_.radius_m), cv::Scalar(now_s_ + kStandS),
             cv::FILLED, cv::LINE_8, kFractionBits);
  seen_until_ = cv::max(seen_until_, stand);  // a longer promise stands
}

void Surroundings::DrawGrid() {
  is_grid_drawn_ = true;
  grid_seen_ = cv::Mat(window_.height, window_.width, CV_8UC1, cv::Scalar(0));
  grid_obstacles_ = cv::Mat(window_.height, window_.width, CV_8UC1, cv::Scalar(255));
  if (!grid_) return;
  const Pose2 grid_from_local = local_from_grid_.Inverse();
  // A cell on along a row is the same step everywhere.
  const double turn = grid_from_local.theta;
  const Eigen::Vector2d step = kResolutionM * Eigen::Vector2d(std::cos(turn), std::sin(turn));
  for (int row = 0; row < window_.height; ++row) {
    const Eigen::Vector2d first = grid_from_local * window_.Centre(0, row);
    for (int column = 0; column < window_.width; ++column) {
      const int cell = grid_->grid.IndexAt(first + column * step);
      if (cell < 0) continue;
      const std::uint8_t occupancy = grid_->occupancy[static_cast<std::size_t>(cell)];
      if (occupancy >= kDoubtfulFrom && occupancy != SeenGrid::kUnknown)
        grid_obstacles_.at<std::uint8_t>(row, column) = 0;
      if (occupancy <= kFreeUpTo) grid_seen_.at<std::uint8_t>(row, column) = 255;
    }
  }
}

void Surroundings::MarkOccupied(const Eigen::Vector2d& point) {
  const int column = window_.Column(point.x());
  const int row = window_.Row(point.y());
  if (window_.Contains(column, row)) obstacles_.at<std::uint8_t>(row, column) = 0;
}

cv::Point Surroundings::Pixel(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d cell =
      (point - window_.origin) / kResolutionM - Eigen::Vector2d::Constant(0.5);
  return {static_cast<int>(std::lround(kFractions * cell.x())),
          static_cast<int>(std::lround(kFractions * cell.y()))};
}

void Surroundings::AddScan() {
  const auto direction_at = [&](double bearing_rad) {
    const double heading = local_from_scan_.theta + bearing_rad;
    return Eigen::Vector2d(std::cos(heading), std::sin(heading));
  };
  const Eigen::Vector2d camera = local_from_scan_.translation();
  const double half_step = 0.5 * scan_->bearing_step_rad;
  cv::Mat floor(window_.height, window_.width, CV_8UC1, cv::Scalar(0));
  for (std::size_t ray = 0; ray < scan_->ranges_m.size(); ++ray) {
    const double seen = std::min<double>(scan_->ground_seen_m[ray], kWindowSideM);
    if (seen <= 0.0) continue;
    const double bearing = scan_->Bearing(ray);
    const std::array<cv::Point, 3> wedge = {
        Pixel(camera), Pixel(camera + seen * direction_at(bearing - half_step)),
        Pixel(camera + seen * direction_at(bearing + half_step))};
    cv::fillConvexPoly(floor, wedge.data(), 3, cv::Scalar(255), cv::LINE_8, kFractionBits);
  }
  const bool is_new = std::exchange(is_scan_new_, false);
  if (is_new) movers_.Add(now_s_, Suspects());
  seen_ |= floor;
  cv::Mat(cv::max(seen_until_, now_s_ + kSightS)).copyTo(seen_until_, floor);
  hidden_until_.setTo(0.0, floor);  // it would hide the floor behind it
  doubted_.setTo(0, floor);

  std::vector<std::size_t> blind_hits;
  for (std::size_t ray = 0; ray < scan_->ranges_m.size(); ++ray) {
    const double range = scan_->ranges_m[ray];
    if (!std::isfinite(range)) continue;
    if (scan_->ground_seen_m[ray] > 0.0F) {
      MarkOccupied(camera + (range + 0.5 * kResolutionM) * direction_at(scan_->Bearing(ray)));
    } else {
      blind_hits.push_back(ray);
    }
  }
  if (!is_new || blind_hits.empty()) return;
  cv::Mat to_known;  // in cells
  cv::distanceTransform(obstacles_, to_known, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat shown(window_.height, window_.width, CV_8UC1, cv::Scalar(0));
  for (const std::size_t ray : blind_hits) {
    const Eigen::Vector2d place =
        HiddenPlace(direction_at(scan_->Bearing(ray)), scan_->ranges_m[ray], to_known);
    const int column = window_.Column(place.x());
    const int row = window_.Row(place.y());
    if (window_.Contains(column, row)) shown.at<std::uint8_t>(row, column) = 255;
  }
  cv::Mat until = cv::max(hidden_until_, now_s_) + kHiddenPerScanS;
  until = cv::min(until, now_s_ + kHiddenS);
  until.copyTo(hidden_until_, shown);
}

std::vector<Eigen::Vector2d> Surroundings::Suspects() const {
  constexpr double kWithinM = 3.0;   // farther hits err by too much
  constexpr double kBehindM = 0.12;  // what stands still seems to come nearer by less
  constexpr double kBodyM = 0.15;
  constexpr double kJustNowS = 1.0;
  const auto was_floor = [&](const Eigen::Vector2d& point) {
    const int column = window_.Column(point.x());
    const int row = window_.Row(point.y());
    if (!window_.Contains(column, row)) return false;
    const double shown_s = seen_until_.at<float>(row, column) - kSightS;
    return shown_s > now_s_ - kJustNowS && shown_s <= now_s_;
  };
  std::vector<Eigen::Vector2d> suspects;
  for (std::size_t ray = 0; ray < scan_->ranges_m.size(); ++ray) {
    const double range = scan_->ranges_m[ray];
    if (!(range < kWithinM) || scan_->ground_seen_m[ray] <= 0.0F) continue;
    const double heading = local_from_scan_.theta + scan_->Bearing(ray);
    const Eigen::Vector2d direction(std::cos(heading), std::sin(heading));
    const Eigen::Vector2d hit = local_from_scan_.translation() + range * direction;
    if (was_floor(hit + kBehindM * direction)) suspects.push_back(hit + kBodyM * direction);
  }
  return suspects;
}

// Not even the nearest visible pixel is floor. What is there stands at this range or anywhere
// nearer, outside the robot. It is what is known to stand beside the ray, if anything is; else it
// is where the floor was not seen, and where all of it was, somebody has stepped in: then the
// nearest place is the one to reckon with.
Eigen::Vector2d Surroundings::HiddenPlace(const Eigen::Vector2d& direction, double range_m,
                                          const cv::Mat& to_known) const {
  std::optional<Eigen::Vector2d> nearest;
  std::optional<Eigen::Vector2d> unseen;
  std::optional<Eigen::Vector2d> known;
  float least = kSameObstacleCells;
  const double end = range_m + kSameObstacleCells * kResolutionM;
  for (double way = 0.0; way < end; way += kResolutionM) {
    const Eigen::Vector2d point = local_from_scan_.translation() + way * direction;
    const int column = window_.Column(point.x());
    const int row = window_.Row(point.y());
    if (!window_.Contains(column, row)) break;
    if (hidden_until_.at<float>(row, column) > now_s_) return point;
    if ((point - base_).norm() < robot_.radius_m + kResolutionM) continue;
    if (to_known.at<float>(row, column) < least) {
      least = to_known.at<float>(row, column);
      known = point;
    }
    if (way > range_m) continue;
    if (!nearest) nearest = point;
    if (!unseen && seen_.at<std::uint8_t>(row, column) == 0) unseen = point;
  }
  if (known) return *known;
  if (unseen) return *unseen;
  return nearest.value_or(local_from_scan_.translation() + range_m * direction);
}

std::vector<Eigen::Vector2d> Surroundings::Hidden() const {
  std::vector<Eigen::Vector2d> middles;
  for (int row = 0; row < hidden_until_.rows; ++row) {
    for (int column = 0; column < hidden_until_.cols; ++column) {
      if (hidden_until_.at<float>(row, column) > now_s_) {
        middles.push_back(window_.Centre(column, row));
      }
    }
  }
  return middles;
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
  ArcView view{length_m, length_m, std::nullopt, at_start - robot.radius_m};
  const double rim_m = robot.radius_m + margin_m;
  Pose2 pose = local_from_base;
  constexpr double kLongestStepM = 0.025;
  const int steps = static_cast<int>(std::ceil(length_m / kLongestStepM));
  const double step = length_m / std::max(1, steps);
  for (int i = 1; i <= steps; ++i) {
    const double way = i * step;
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
      if (view.unseen || surroundings.IsSeen(rim)) continue;
      view.unseen = rim;
      view.seen_m = way - step;
    }
    if (view.free_m < way && view.seen_m < way) break;
  }
  return view;
}

}  // namespace beckon
