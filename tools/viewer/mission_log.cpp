#include "tools/viewer/mission_log.hpp"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/text.hpp"

namespace beckon {
namespace {

constexpr std::chrono::seconds kSilent{3};
constexpr const char* kServices[] = {"beacon_reader",   "rssi_localizer", "camera_grabber",
                                     "ground_detector", "range_caster",   "navigator"};
// Smaller steps are the estimate's noise, not a way that was driven.
constexpr double kLeastStepM = 0.02;

std::string StateText(const Scene& scene) {
  if (!scene.status) return "navigator silent";
  const navigator_status_t& status = *scene.status;
  switch (status.state) {
    case navigator_status_t::IDLE:
      return "waiting for a call";
    case navigator_status_t::DRIVING:
      return "driving";
    case navigator_status_t::STOPPED:
      return "stopped: " + status.stop_reason;
    case navigator_status_t::ARRIVED:
      return "arrived";
    case navigator_status_t::GAVE_UP:
      return "gave up: " + status.detail;
    default:
      return "state " + std::to_string(status.state);
  }
}

}  // namespace

std::optional<Truth> ReadTruth(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::string last;
  while (std::getline(stream, line)) {
    if (!stream.eof()) last = line;  // a line without its end is still being written
  }
  const auto json = nlohmann::json::parse(last, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  Truth truth;
  truth.caller = {json.at("caller").at(0).get<double>(), json.at("caller").at(1).get<double>()};
  truth.distance_to_caller_m = json.at("distance_to_caller_m").get<double>();
  truth.closest_approach_m = json.at("closest_approach_m").get<double>();
  truth.path_length_m = json.at("path_length_m").get<double>();
  truth.collisions = json.at("collisions").get<int>();
  return truth;
}

void MissionLog::OnHealth(const service_health_t& health, Instant now) {
  health_[health.service] = {health, now.steady};
}

void MissionLog::OnLocation(const location_t& location) { locations_[location.tag] = location; }

void MissionLog::OnPose(const Pose2& map_from_robot) {
  if (!last_pose_) last_pose_ = map_from_robot;
  const double step = (map_from_robot.translation() - last_pose_->translation()).norm();
  if (step < kLeastStepM) return;
  path_length_m_ += step;
  last_pose_ = map_from_robot;
}

double MissionLog::elapsed_s(Instant now) const {
  return started_ ? std::chrono::duration<double>(now.steady - started_->steady).count() : 0.0;
}

double MissionLog::scans_per_second(Instant now) const {
  const double elapsed = elapsed_s(now);
  return elapsed > 0.0 ? scans_ / elapsed : 0.0;
}

std::string MissionLog::HealthText(Instant now) const {
  std::string troubled;
  for (const char* service : kServices) {
    const auto entry = health_.find(service);
    std::string trouble;
    if (entry == health_.end() || now.steady - entry->second.arrived > kSilent) {
      trouble = "silent";
    } else if (entry->second.message.state != service_health_t::OK) {
      trouble = entry->second.message.reason;
    }
    if (!trouble.empty())
      troubled += (troubled.empty() ? "" : "; ") + std::string(service) + ": " + trouble;
  }
  return troubled.empty() ? "all healthy" : troubled;
}

std::string MissionLog::Line(const Scene& scene, Instant now) {
  if (!started_) {
    started_ = now;
    last_line_ = now.steady;
    scans_ = 0;
  }
  const double since_s = std::chrono::duration<double>(now.steady - last_line_).count();
  const double rate = since_s > 0.0 ? (scans_ - scans_at_last_line_) / since_s : 0.0;
  last_line_ = now.steady;
  scans_at_last_line_ = scans_;

  std::string line = Format("%4.0f s  %-22s", elapsed_s(now), StateText(scene).c_str());
  if (scene.map_from_robot) {
    const Pose2& pose = *scene.map_from_robot;
    line += Format("  at %5.2f %5.2f %4.0f deg", pose.x, pose.y, DegreesFromRadians(pose.theta));
  }
  if (scene.status && scene.status->has_goal)
    line += Format("  to go %5.2f m", scene.status->distance_to_go_m);
  if (scene.status) {
    line += std::isfinite(scene.status->nearest_obstacle_m)
                ? Format("  obstacle %4.2f m", scene.status->nearest_obstacle_m)
                : std::string("  obstacle none  ");
  }
  if (scene.status && locations_.contains(scene.status->tag)) {
    const location_t& location = locations_[scene.status->tag];
    // The radius of a circle as large as the area that holds 90 %.
    line += Format("  tag within %4.1f m", std::sqrt(location.area_90_m2 / std::numbers::pi));
  }
  line += Format("  %4.1f scans/s  ", rate);
  return line + HealthText(now);
}

}  // namespace beckon
