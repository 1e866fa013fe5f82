#include "tools/viewer/scene.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "common/label_runs.hpp"
#include "services/ground_detector/overlay.hpp"

namespace beckon {
namespace {

constexpr int kHeight = 480;
constexpr int kMaxWidth = 640;
constexpr int kMargin = 12;
constexpr int kShift = 4;  // fractional bits of drawing coordinates

const cv::Scalar kPaper(255, 255, 255);
const cv::Scalar kWallColour(40, 40, 40);
const cv::Scalar kBlocked(205, 205, 205);
const cv::Scalar kSeenObstacle(60, 110, 230);
const cv::Scalar kRouteColour(200, 120, 0);
const cv::Scalar kRobotColour(60, 160, 30);
const cv::Scalar kScanColour(40, 40, 220);
const cv::Scalar kCallerColour(180, 0, 160);
const cv::Scalar kText(30, 30, 30);

// Map frame to pixels of the map panel: y up becomes v down.
class MapView {
 public:
  explicit MapView(const FloorPlan& plan) : min_(plan.min) {
    const Eigen::Vector2d extent = plan.max - plan.min;
    scale_ =
        std::min((kHeight - 2.0 * kMargin) / extent.y(), (kMaxWidth - 2.0 * kMargin) / extent.x());
    width_ = static_cast<int>(std::ceil(extent.x() * scale_)) + 2 * kMargin;
    top_ = (kHeight + extent.y() * scale_) / 2.0;
  }
  int width() const { return width_; }
  cv::Point2d Pixel(const Eigen::Vector2d& point) const {
    return {kMargin + (point.x() - min_.x()) * scale_, top_ - (point.y() - min_.y()) * scale_};
  }
  cv::Point Fixed(const Eigen::Vector2d& point) const {
    const cv::Point2d pixel = Pixel(point) * static_cast<double>(1 << kShift);
    return {cvRound(pixel.x), cvRound(pixel.y)};
  }
  int Length(double length_m) const { return cvRound(length_m * scale_ * (1 << kShift)); }
  double pixels_per_m() const { return scale_; }

 private:
  Eigen::Vector2d min_;
  double scale_;
  double top_;
  int width_;
};

void FillCell(cv::Mat& map, const MapView& view, const std::vector<Eigen::Vector2d>& corners,
              const cv::Scalar& colour) {
  std::vector<cv::Point> pixels;
  for (const auto& corner : corners) pixels.push_back(view.Fixed(corner));
  cv::fillConvexPoly(map, pixels, colour, cv::LINE_8, kShift);
}

std::vector<Eigen::Vector2d> CellCorners(const GridGeometry& grid, int column, int row) {
  const Eigen::Vector2d corner = grid.origin + grid.resolution_m * Eigen::Vector2d(column, row);
  const double side = grid.resolution_m;
  return {corner, corner + Eigen::Vector2d(side, 0.0), corner + Eigen::Vector2d(side, side),
          corner + Eigen::Vector2d(0.0, side)};
}

void DrawPossibleArea(const probability_map_t& area, const MapView& view, cv::Mat& map) {
  const GridGeometry grid{
      {area.origin[0], area.origin[1]}, area.resolution_m, area.width, area.height};
  constexpr int kLevel90 = 230;
  for (int row = 0; row < grid.height; ++row) {
    for (int column = 0; column < grid.width; ++column) {
      const int level = area.credible_level[static_cast<std::size_t>(grid.Index(column, row))];
      if (level >= kLevel90) continue;
      // The likelier, the stronger.
      const double strength = 0.25 + 0.6 * (1.0 - static_cast<double>(level) / kLevel90);
      FillCell(map, view, CellCorners(grid, column, row),
               kPaper * (1.0 - strength) + cv::Scalar(80, 200, 255) * strength);
    }
  }
}

void DrawFloorPlan(const FloorPlan& plan, const MapView& view, cv::Mat& map) {
  if (plan.image) {
    const MapImage& image = *plan.image;
    for (int row = 0; row < image.grid.height; ++row) {
      for (int column = 0; column < image.grid.width; ++column) {
        if (image.free.at<std::uint8_t>(row, column) == 0) {
          FillCell(map, view, CellCorners(image.grid, column, row), kBlocked);
        }
      }
    }
  }
  for (const auto& obstacle : plan.obstacles) {
    std::vector<cv::Point> pixels;
    for (const auto& corner : obstacle) pixels.push_back(view.Fixed(corner));
    cv::fillPoly(map, std::vector<std::vector<cv::Point>>{pixels}, kBlocked, cv::LINE_AA, kShift);
  }
  for (const Wall& face : plan.Faces()) {
    cv::line(map, view.Fixed(face.from), view.Fixed(face.to), kWallColour, 2, cv::LINE_AA, kShift);
  }
}

void DrawGrid(const occupancy_grid_t& message, const Pose2& map_from_robot, const MapView& view,
              cv::Mat& map) {
  const GridGeometry grid{Eigen::Vector2d::Zero(), message.resolution_m, message.width,
                          message.height};
  const Pose2 grid_from_robot{message.grid_from_robot[0], message.grid_from_robot[1],
                              message.grid_from_robot[2]};
  const Pose2 map_from_grid = map_from_robot * grid_from_robot.Inverse();
  for (int row = 0; row < grid.height; ++row) {
    for (int column = 0; column < grid.width; ++column) {
      const int occupancy = message.occupancy[static_cast<std::size_t>(grid.Index(column, row))];
      if (occupancy <= occupancy_grid_t::OCCUPIED / 2 || occupancy == occupancy_grid_t::UNKNOWN)
        continue;
      auto corners = CellCorners(grid, column, row);
      for (auto& corner : corners) corner = map_from_grid * corner;
      FillCell(map, view, corners, kSeenObstacle);
    }
  }
}

void DrawScan(const bot_core::planar_lidar_t& scan, const Pose2& map_from_robot,
              const MapView& view, cv::Mat& map) {
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    if (!std::isfinite(scan.ranges[i])) continue;
    const double bearing = scan.rad0 + static_cast<double>(i) * scan.radstep;
    const Eigen::Vector2d hit =
        scan.ranges[i] * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
    cv::circle(map, view.Fixed(map_from_robot * hit), 2 << kShift, kScanColour, cv::FILLED,
               cv::LINE_AA, kShift);
  }
}

void DrawStatus(const navigator_status_t& status, const MapView& view, cv::Mat& map) {
  if (!status.has_goal) return;
  for (std::size_t i = 1; i < status.route.size(); ++i) {
    cv::line(map, view.Fixed({status.route[i - 1][0], status.route[i - 1][1]}),
             view.Fixed({status.route[i][0], status.route[i][1]}), kRouteColour, 2, cv::LINE_AA,
             kShift);
  }
  cv::drawMarker(map, view.Pixel({status.goal[0], status.goal[1]}), kRouteColour,
                 cv::MARKER_TILTED_CROSS, 12, 2);
}

cv::Mat DrawMap(const Site& site, const RobotOptions& robot, const Scene& scene) {
  const MapView view(site.plan);
  cv::Mat map(kHeight, view.width(), CV_8UC3, kPaper);
  if (scene.possible_area) DrawPossibleArea(*scene.possible_area, view, map);
  if (scene.grid && scene.map_from_robot) DrawGrid(*scene.grid, *scene.map_from_robot, view, map);
  DrawFloorPlan(site.plan, view, map);
  for (const Beacon& beacon : site.beacons) {
    cv::drawMarker(map, view.Pixel(beacon.position.head<2>()), kText, cv::MARKER_TRIANGLE_UP, 9, 1,
                   cv::LINE_AA);
  }
  if (scene.status) DrawStatus(*scene.status, view, map);
  if (scene.true_caller) {
    cv::circle(map, view.Fixed(*scene.true_caller), view.Length(0.15), kCallerColour, cv::FILLED,
               cv::LINE_AA, kShift);
  }
  if (scene.map_from_robot) {
    const Pose2& pose = *scene.map_from_robot;
    if (scene.scan) DrawScan(*scene.scan, pose, view, map);
    const Eigen::Vector2d centre = pose * Eigen::Vector2d(robot.centre_x_m, 0.0);
    cv::circle(map, view.Fixed(centre), view.Length(robot.radius_m), kRobotColour, 2, cv::LINE_AA,
               kShift);
    cv::line(map, view.Fixed(centre),
             view.Fixed(pose * Eigen::Vector2d(robot.centre_x_m + robot.radius_m, 0.0)),
             kRobotColour, 2, cv::LINE_AA, kShift);
  }
  return map;
}

cv::Mat DrawCamera(const Scene& scene) {
  cv::Mat panel(kHeight, kMaxWidth, CV_8UC3, cv::Scalar(60, 60, 60));
  if (scene.frames.empty()) {
    cv::putText(panel, "no camera", {240, 240}, cv::FONT_HERSHEY_SIMPLEX, 0.8, kPaper, 1,
                cv::LINE_AA);
    return panel;
  }
  // The frame that the labels belong to, or else the newest.
  auto frame = std::prev(scene.frames.end());
  bool has_labels = false;
  for (auto it = scene.frames.begin(); scene.ground && it != scene.frames.end(); ++it) {
    if (it->utime == scene.ground->utime) {
      frame = it;
      has_labels = true;
    }
  }
  cv::Mat picture = cv::imdecode(frame->data, cv::IMREAD_COLOR);
  if (picture.empty()) return panel;
  if (has_labels && scene.ground->width == picture.cols && scene.ground->height == picture.rows) {
    picture = DrawOverlay(picture, DecodeLabels(scene.ground->runs, picture.cols, picture.rows));
  }
  const double scale = std::min(static_cast<double>(kMaxWidth) / picture.cols,
                                static_cast<double>(kHeight) / picture.rows);
  cv::resize(picture, picture, {}, scale, scale, cv::INTER_AREA);
  picture.copyTo(panel(cv::Rect(0, 0, picture.cols, picture.rows)));
  return panel;
}

std::string StatusText(const navigator_status_t& status) {
  static const char* const kStates[] = {"idle", "driving", "stopped", "arrived", "gave up"};
  const bool known = status.state >= 0 && status.state <= navigator_status_t::GAVE_UP;
  std::string text = known ? kStates[status.state] : "?";
  if (!status.stop_reason.empty()) text += ": " + status.stop_reason;
  return text;
}

}  // namespace

cv::Mat DrawScene(const Site& site, const RobotOptions& robot, const Scene& scene) {
  const cv::Mat camera = DrawCamera(scene);
  cv::Mat picture;
  cv::hconcat(camera, DrawMap(site, robot, scene), picture);
  if (scene.status) {
    const std::string text = StatusText(*scene.status);
    cv::putText(picture, text, {8, kHeight - 10}, cv::FONT_HERSHEY_SIMPLEX, 0.6, cv::Scalar::all(0),
                3, cv::LINE_AA);
    cv::putText(picture, text, {8, kHeight - 10}, cv::FONT_HERSHEY_SIMPLEX, 0.6, kPaper, 1,
                cv::LINE_AA);
  }
  return picture;
}

}  // namespace beckon
