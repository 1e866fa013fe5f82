// From a route to a velocity: pure pursuit with a speed that obeys what lies on the way.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "services/navigator/surroundings.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

struct FollowerOptions {
  double min_lookahead_m = 0.25;
  double max_lookahead_m = 0.80;
  double turn_in_place_rad = 0.8;  // heading errors beyond this are turned away on the spot
  double scan_turn_radps =
      0.8;                 // turns on the spot are no faster: the camera has to see where they end
  double margin_m = 0.04;  // kept free around the disc; more than the safety monitor's
  static constexpr double kSpareS = 0.05;
  double reaction_s = 0.2 + kSpareS;  // the safety monitor's, with something to spare
};
void ReadFollowerOptions(ConfigTable& table, FollowerOptions& options);

struct Step {
  Velocity velocity;
  std::string blocked_by;  // stop reason; empty where the robot can go (or turn)
  double distance_to_go_m = 0.0;
};

// Regulated pure pursuit (Macenski et al. 2023) with turns on the spot: the point on the route to
// steer for is the farthest that can be reached in a straight line; the speed allows a stop before
// whatever is on the arc, and before floor that was not seen. Where it stands before such floor, it
// turns to look there, outermost first. Where the arc is blocked, another one that leads near the
// same point will do, or else a heading from which there is one.
class PathFollower {
 public:
  PathFollower(const RobotOptions& robot, const FollowerOptions& options)
      : robot_(robot), options_(options) {}

  // `route`: in the local frame, at least one point.
  Step Follow(Instant now, const std::vector<Eigen::Vector2d>& route, const Pose2& local_from_base,
              const Surroundings& surroundings);
  // Turns on the spot and looks aside are judged anew.
  void Reset();
  // Angular velocity that turns by the angle and stops there, rad/s.
  double TurnRate(double angle_rad) const;

 private:
  struct Projection {
    std::size_t segment;
    double along_m;      // from the segment's start
    double remaining_m;  // to the route's end
  };
  static Projection Project(const std::vector<Eigen::Vector2d>& route,
                            const Eigen::Vector2d& point);
  static Eigen::Vector2d Ahead(const std::vector<Eigen::Vector2d>& route, const Projection& from,
                               double distance_m);
  Eigen::Vector2d Lookahead(const std::vector<Eigen::Vector2d>& route, const Projection& from,
                            const Pose2& local_from_base, const Surroundings& surroundings) const;
  std::optional<double> FreeArc(const Eigen::Vector2d& target, const Pose2& local_from_base,
                                const Surroundings& surroundings) const;
  // A heading in which the way is free, where it is blocked in the one that leads to the target.
  std::optional<double> FreeHeading(double bearing_rad, const Pose2& local_from_base,
                                    const Surroundings& surroundings) const;
  double SpeedToStopWithin(double distance_m) const;
  // Turns the camera to floor that has to be seen first; nothing once that is done.
  std::optional<Step> LookAside(Instant now, const Pose2& local_from_base,
                                const Surroundings& surroundings);

  RobotOptions robot_;
  FollowerOptions options_;
  bool is_turning_ = false;
  std::optional<double> detour_heading_rad_;
  struct Look {
    Eigen::Vector2d at;                  // what has to be seen, local frame
    Eigen::Vector2d beyond;              // and a little farther aside
    std::optional<Instant> faced_since;  // the camera points there
  };
  std::optional<Look> look_;
  std::optional<Look> vain_look_;  // nothing was to be seen there
};

}  // namespace beckon
