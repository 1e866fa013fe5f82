// A small world for closed-loop tests: a disc on wheels among upright faces and people, seen
// through a camera's virtual scan. Runs as fast as it can; the same seed gives the same run.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "common/clock.hpp"
#include "common/floor_plan.hpp"
#include "services/navigator/navigator.hpp"
#include "services/range_caster/grid_mapper.hpp"
#include "tools/evaluation/navigation/truth_scan.hpp"

namespace beckon::testing {

struct Person {
  Eigen::Vector2d position;
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // m/s
  double radius_m = 0.2;
};

struct TestWorldOptions {
  std::uint64_t seed = 1;
  ScanFaults faults;
  double pose_noise_m = 0.0;  // sd of each pose
  double pose_noise_rad = 0.0;
  Pose2 pose_bias;  // the map's origin as the localizer has it
  double odometry_drift_rad_per_m = 0.0;
  bool has_odometry = true;
  double scan_latency_s = 0.12;
};

class TestWorld {
 public:
  // `plan` is what the navigator knows; `unknown` stands in the world as well.
  TestWorld(const FloorPlan& plan, const std::vector<Polygon>& unknown, const Pose2& map_from_base,
            const TestWorldOptions& options = {},
            const NavigatorOptions& navigator = DefaultNavigator());

  static NavigatorOptions DefaultNavigator();

  // Runs for a time, or until `done`; returns whether it was done.
  bool Run(
      double seconds, const std::function<bool()>& done = [] { return false; });
  // Until the call has come to its end.
  bool RunToEnd(double seconds);

  void CallTo(const Eigen::Vector2d& point);
  void CallByTag(const std::string& tag);
  // The tag is heard from here, ten times a second, with this 90 % area.
  void PutTag(const std::string& tag, const Eigen::Vector2d& position, double area_90_m2 = 2.0);

  Navigator& navigator() { return navigator_; }
  const NavigatorStatus& status() const { return navigator_.status(); }
  Instant now() const { return clock_.Now(); }
  ManualClock& clock() { return clock_; }
  Eigen::Vector2d position() const { return base_.translation(); }
  const Pose2& base() const { return base_; }
  double speed() const { return velocity_.linear_mps; }
  double closest_m() const { return closest_m_; }  // least free space around the disc so far
  bool has_collided() const { return closest_m_ < 0.0; }
  double driven_m() const { return driven_m_; }
  double turned_rad() const { return turned_rad_; }
  double elapsed_s() const;

  std::vector<Person> people;
  // What becomes of a scan before it is delivered; false: it is lost.
  std::function<bool(Scan&)> tamper_scan = [](Scan&) { return true; };
  std::function<bool(Utime&, Pose2&)> tamper_pose = [](Utime&, Pose2&) { return true; };
  std::function<bool(Utime&, Pose2&)> tamper_odometry = [](Utime&, Pose2&) { return true; };
  // Called after each tick, 20 times a second.
  std::function<void(const Velocity&)> on_command = [](const Velocity&) {};

 private:
  void Move(double step_s);
  void Sense();
  void Deliver();
  double Range(double bearing_rad) const;
  double FreeSpace(const Eigen::Vector2d& point) const;
  double Noise(double sd) { return sd * normal_(random_); }

  TestWorldOptions options_;
  RobotOptions robot_;
  TruthScanner scanner_;
  GridMapper mapper_;
  std::vector<Wall> faces_;
  ManualClock clock_;
  Instant started_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  Navigator navigator_;

  Pose2 base_;  // map frame, truth
  Pose2 odometry_from_robot_;
  Velocity velocity_;
  Velocity command_;
  struct Tag {
    std::string name;
    Eigen::Vector2d position;
    double area_90_m2;
  };
  std::vector<Tag> tags_;
  struct InFlight {
    Instant at;
    Scan scan;
  };
  std::deque<InFlight> in_flight_;
  int milliseconds_ = 0;
  double closest_m_ = 1e9;
  double driven_m_ = 0.0;
  double turned_rad_ = 0.0;
};

}  // namespace beckon::testing
