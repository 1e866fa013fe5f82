#include "tools/evaluation/navigation/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/statistics.hpp"
#include "tools/simulation/solids.hpp"

namespace beckon {
namespace {

double Median(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  return Quantile(std::move(values), 0.5);
}

struct Summary {
  int missions = 0, arrived = 0, collided = 0, gave_up = 0, unreachable = 0, elsewhere = 0,
      timeout = 0;
  double path_ratio_median = 0.0;
  double closest_m_min = std::numeric_limits<double>::infinity();
  double time_s_median = 0.0;
  double final_distance_m_median = 0.0;
  double pose_error_m_median = 0.0;
  std::map<std::string, int> stops;
  double reversals_per_m = 0.0;
};

Summary Summarise(const std::vector<Mission>& missions) {
  Summary summary;
  std::vector<double> ratios, times, distances, pose_errors;
  int reversals = 0;
  double path_m = 0.0;
  for (const Mission& mission : missions) {
    ++summary.missions;
    summary.arrived += mission.outcome == "arrived" ? 1 : 0;
    summary.collided += mission.outcome == "collided" ? 1 : 0;
    summary.gave_up += mission.outcome == "gave_up" ? 1 : 0;
    summary.unreachable += mission.outcome == "unreachable" ? 1 : 0;
    summary.elsewhere += mission.outcome == "elsewhere" ? 1 : 0;
    summary.timeout += mission.outcome == "timeout" ? 1 : 0;
    summary.closest_m_min = std::min(summary.closest_m_min, mission.closest_m);
    for (const auto& [reason, count] : mission.stops) summary.stops[reason] += count;
    reversals += mission.reversals;
    path_m += mission.path_m;
    pose_errors.push_back(mission.pose_error_m);
    if (mission.outcome != "arrived") continue;
    ratios.push_back(mission.path_ratio());
    times.push_back(mission.time_s);
    distances.push_back(mission.final_distance_m);
  }
  summary.path_ratio_median = Median(ratios);
  summary.reversals_per_m = path_m > 0.0 ? reversals / path_m : 0.0;
  summary.time_s_median = Median(times);
  summary.final_distance_m_median = Median(distances);
  summary.pose_error_m_median = Median(pose_errors);
  return summary;
}

// Pixels of a picture of the flat, y up.
struct Canvas {
  static constexpr double kPixelsPerMetre = 60.0;
  static constexpr double kFrameM = 0.4;
  Eigen::Vector2d min, max;
  cv::Mat image;

  explicit Canvas(const simulation::World& world) : min(world.min), max(world.max) {
    const Eigen::Vector2d size =
        kPixelsPerMetre * (max - min + Eigen::Vector2d::Constant(2.0 * kFrameM));
    image = cv::Mat(static_cast<int>(size.y()) + 60, static_cast<int>(size.x()), CV_8UC3,
                    cv::Scalar::all(255));
  }
  cv::Point At(const Eigen::Vector2d& point) const {
    return {static_cast<int>(std::lround(kPixelsPerMetre * (point.x() - min.x() + kFrameM))),
            static_cast<int>(std::lround(kPixelsPerMetre * (max.y() - point.y() + kFrameM)))};
  }
  void Line(const std::vector<Eigen::Vector2d>& points, const cv::Scalar& colour, int width) {
    for (std::size_t i = 1; i < points.size(); ++i) {
      cv::line(image, At(points[i - 1]), At(points[i]), colour, width, cv::LINE_AA);
    }
  }
  void Disc(const Eigen::Vector2d& centre, double radius_m, const cv::Scalar& colour, int width) {
    cv::circle(image, At(centre), static_cast<int>(kPixelsPerMetre * radius_m), colour, width,
               cv::LINE_AA);
  }
};

}  // namespace

std::string MissionsAsJson(const std::vector<Mission>& missions) {
  const Summary summary = Summarise(missions);
  nlohmann::json runs = nlohmann::json::array();
  for (const Mission& mission : missions) {
    runs.push_back({{"seed", mission.seed},
                    {"outcome", mission.outcome},
                    {"reason", mission.reason},
                    {"time_s", mission.time_s},
                    {"path_m", mission.path_m},
                    {"shortest_m", mission.shortest_m},
                    {"closest_m", mission.closest_m},
                    {"closest_to", mission.closest_to},
                    {"final_distance_m", mission.final_distance_m},
                    {"pose_error_m", mission.pose_error_m},
                    {"reversals", mission.reversals},
                    {"stops", mission.stops}});
  }
  const nlohmann::json all = {{"missions", summary.missions},
                              {"arrived", summary.arrived},
                              {"collided", summary.collided},
                              {"gave_up", summary.gave_up},
                              {"unreachable", summary.unreachable},
                              {"elsewhere", summary.elsewhere},
                              {"timeout", summary.timeout},
                              {"path_ratio_median", summary.path_ratio_median},
                              {"closest_m_min", summary.closest_m_min},
                              {"time_s_median", summary.time_s_median},
                              {"final_distance_m_median", summary.final_distance_m_median},
                              {"pose_error_m_median", summary.pose_error_m_median},
                              {"reversals_per_m", summary.reversals_per_m},
                              {"stops", summary.stops},
                              {"runs", runs}};
  return all.dump(2) + "\n";
}

std::string MissionAsLine(const Mission& mission) {
  char line[256];
  std::snprintf(line, sizeof(line),
                "%6llu  %-11s  %6.1f s  %6.2f m  x %.2f  %5.2f m  %5.2f m  %s\n",
                static_cast<unsigned long long>(mission.seed), mission.outcome.c_str(),
                mission.time_s, mission.path_m, mission.path_ratio(), mission.closest_m,
                mission.final_distance_m, mission.reason.c_str());
  return line;
}

std::string MissionsAsTable(const std::vector<Mission>& missions) {
  const Summary summary = Summarise(missions);
  char text[640];
  std::snprintf(text, sizeof(text),
                "%d missions: %d arrived, %d collided, %d gave up, %d unreachable, %d elsewhere, "
                "%d timed out\n"
                "path over shortest %.2f, time %.1f s, distance to the caller %.2f m (medians); "
                "closest %.3f m; steering reversed %.2f times a metre; pose wrong by at most %.2f "
                "m (median)\n"
                "stops:",
                summary.missions, summary.arrived, summary.collided, summary.gave_up,
                summary.unreachable, summary.elsewhere, summary.timeout, summary.path_ratio_median,
                summary.time_s_median, summary.final_distance_m_median, summary.closest_m_min,
                summary.reversals_per_m, summary.pose_error_m_median);
  std::string table = text;
  for (const auto& [reason, count] : summary.stops) {
    table += " " + reason + " " + std::to_string(count);
  }
  return table + "\n";
}

void DrawMission(const Mission& mission, const std::filesystem::path& file) {
  const simulation::World world = ScenarioWorld(mission.scenario, mission.seed);
  Canvas canvas(world);
  for (const simulation::Solid& solid : world.solids) {
    const bool is_wall = solid.kind == simulation::SolidKind::kWall;
    const cv::Scalar colour = is_wall ? cv::Scalar(60, 60, 60) : cv::Scalar(130, 160, 190);
    if (solid.is_cylinder()) {
      canvas.Disc(solid.centre, solid.radius, colour, cv::FILLED);
      continue;
    }
    std::vector<cv::Point> corners;
    for (const Eigen::Vector2d& corner : solid.footprint) corners.push_back(canvas.At(corner));
    cv::fillConvexPoly(canvas.image, corners, colour, cv::LINE_AA);
  }
  for (const simulation::WalkingPerson& person : world.people) {
    canvas.Line(person.waypoints, cv::Scalar(200, 180, 200), 1);
  }
  canvas.Line(mission.route, cv::Scalar(0, 170, 0), 1);
  canvas.Line(mission.trail, cv::Scalar(200, 80, 0), 2);
  canvas.Disc(world.caller, 0.12, cv::Scalar(0, 0, 220), cv::FILLED);
  if (!mission.trail.empty()) {
    canvas.Disc(mission.trail.front(), 0.08, cv::Scalar(200, 80, 0), cv::FILLED);
    canvas.Disc(mission.trail.back(), DefaultMissionOptions().navigator.robot.radius_m,
                cv::Scalar(200, 80, 0), 2);
  }
  cv::putText(
      canvas.image,
      "seed " + std::to_string(mission.seed) + ": " + mission.outcome + ", " + mission.reason,
      {10, canvas.image.rows - 20}, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar::all(0), 1,
      cv::LINE_AA);
  std::filesystem::create_directories(file.parent_path());
  if (!cv::imwrite(file.string(), canvas.image)) {
    throw std::runtime_error("cannot write " + file.string());
  }
}

}  // namespace beckon
