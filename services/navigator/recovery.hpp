// What the robot tries when it does not get on: backs out of where it stands, and looks round.
#pragma once

#include <optional>
#include <string>

#include "services/navigator/path_follower.hpp"
#include "services/navigator/safety_monitor.hpp"
#include "services/navigator/surroundings.hpp"

namespace beckon {

// Poses are of the footprint's middle, in the local frame.
class Recovery {
 public:
  // All have to outlive this. `margin_m`: kept free around the disc.
  Recovery(const RobotOptions& robot, const PathFollower& follower, const SafetyMonitor& monitor,
           double margin_m)
      : robot_(robot), follower_(follower), monitor_(monitor), margin_m_(margin_m) {}

  // Begins the next attempt: backing out and looking round in turn, and looking round where there
  // is no way back. False when enough have been made since the robot last got away from where it
  // stood.
  bool Start(const Pose2& local_from_base, const Surroundings& surroundings);
  void StartLookingAround(const Pose2& local_from_base);
  void Stop() { maneuver_.reset(); }
  // The robot is here, and not at it: far enough away, the attempts begin anew.
  void NoteProgress(const Pose2& local_from_base);
  void ForgetAttempts() { attempts_ = 0; }

  bool is_active() const { return maneuver_.has_value(); }
  bool is_looking_around() const { return maneuver_ == Maneuver::kLookAround; }
  int attempts() const { return attempts_; }
  // What it is at, for people.
  std::string Description() const;

  // What to do now; nothing when it is over.
  std::optional<Velocity> Continue(const Pose2& local_from_base, const Surroundings& surroundings);

 private:
  enum class Maneuver { kLookAround, kBackOut };

  std::optional<Velocity> LookAround(const Pose2& local_from_base);
  std::optional<Velocity> BackOut(const Pose2& local_from_base, const Surroundings& surroundings);
  double FreeBehind(const Pose2& local_from_base, const Surroundings& surroundings,
                    double distance_m) const;
  std::optional<double> HeadingToBackOut(const Pose2& local_from_base,
                                         const Surroundings& surroundings) const;

  const RobotOptions& robot_;
  const PathFollower& follower_;
  const SafetyMonitor& monitor_;
  const double margin_m_;

  std::optional<Maneuver> maneuver_;
  int attempts_ = 0;
  bool is_back_next_ = false;
  Pose2 from_;  // where the attempt began
  double back_out_heading_rad_ = 0.0;
  double turned_rad_ = 0.0;
  double last_heading_rad_ = 0.0;
};

}  // namespace beckon
