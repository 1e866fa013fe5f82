// What happened in a mission, in a line a second and a summary at the end.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "beckon/location_t.hpp"
#include "beckon/service_health_t.hpp"
#include "common/clock.hpp"
#include "tools/viewer/answer_times.hpp"
#include "tools/viewer/scene.hpp"

namespace beckon {

// What the simulator knows and the robot does not: the newest line of the file that
// `simulate_robot --truth` writes.
struct Truth {
  Eigen::Vector2d caller = Eigen::Vector2d::Zero();  // m, map frame
  double distance_to_caller_m = 0.0;
  double closest_approach_m = 0.0;  // of the robot's edge to anything, so far
  double path_length_m = 0.0;
  int collisions = 0;
};

// Nothing while the file is not there or holds no whole line yet.
std::optional<Truth> ReadTruth(const std::filesystem::path& file);

class MissionLog {
 public:
  void OnHealth(const service_health_t& health, Instant now);
  void OnLocation(const location_t& location);
  void OnScan() { ++scans_; }
  void OnPose(const Pose2& map_from_robot);

  AnswerTimes& answers() { return answers_; }

  // One line for a person: time, state, pose, distance to go, nearest obstacle, tag, pictures,
  // health.
  std::string Line(const Scene& scene, Instant now);

  double path_length_m() const { return path_length_m_; }
  // SCAN messages per second since the first call of Line.
  double scans_per_second(Instant now) const;
  double elapsed_s(Instant now) const;

 private:
  struct HealthEntry {
    service_health_t message;
    std::chrono::microseconds arrived;
  };
  std::string HealthText(Instant now) const;

  AnswerTimes answers_;
  std::map<std::string, HealthEntry> health_;
  std::map<std::string, location_t> locations_;
  std::optional<Pose2> last_pose_;
  double path_length_m_ = 0.0;
  std::optional<Instant> started_;
  int scans_ = 0;
  int scans_at_last_line_ = 0;
  std::chrono::microseconds last_line_{};
};

}  // namespace beckon
