// Comes when called: from a CALL to velocities, round obstacles, and safely.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/floor_plan.hpp"
#include "services/navigator/destination.hpp"
#include "services/navigator/local_frame.hpp"
#include "services/navigator/path_follower.hpp"
#include "services/navigator/recovery.hpp"
#include "services/navigator/route_planner.hpp"
#include "services/navigator/safety_monitor.hpp"
#include "services/navigator/surroundings.hpp"
#include "services/navigator/types.hpp"
#include "services/navigator/wanderer.hpp"

namespace beckon {

struct NavigatorOptions {
  RobotOptions robot;
  SafetyOptions safety;
  RouteOptions route;
  FollowerOptions follower;
  ArrivalOptions arrival;
  double give_up_after_s =
      60.0;  // without coming nearer, standing for the safety's sake not counted
  // Without ROBOT_POSE for so long, a robot that is called turns and drives into free floor, so
  // that it can be located. 0: it stands and waits.
  double find_itself_after_s = 5.0;
};

// One call at a time. Inputs are handed in as they arrive, Tick() turns them into a command. All
// times are passed in, so that it can be run at any pace. Inputs that make no sense throw
// std::invalid_argument and otherwise count as what they are: a reason to stop.
class Navigator {
 public:
  Navigator(const NavigatorOptions& options, const FloorPlan& plan);
  Navigator(const Navigator&) = delete;  // its parts know each other
  Navigator& operator=(const Navigator&) = delete;

  // A call that was made too long ago, or by a clock that is wrong, is refused: somebody plays a
  // log back, or it would be obeyed when the caller has long gone. A CANCEL always holds.
  void OnCall(Instant now, const Call& call);
  // Goes on with a call that was accepted before this program was restarted, however old.
  void Resume(Instant now, const Call& call);
  void OnLocation(Instant now, const LocatedTag& location);
  // Used where the tag turns out not to be where it was thought.
  void OnPossibleArea(Instant now, const PossibleArea& area);
  void OnPose(Instant now, Utime utime, const Pose2& map_from_robot);
  void OnOdometry(Instant now, Utime utime, const Pose2& odometry_from_robot);
  void OnScan(Instant now, Scan scan);
  void OnGrid(Instant now, SeenGrid grid);
  // A message on SCAN, ROBOT_POSE or ODOMETRY that could not even be understood.
  void OnInvalidScan(Instant now) { monitor_.OnInvalidScan(now); }
  void OnInvalidPose(Instant now) { monitor_.OnInvalidPose(now); }
  void OnInvalidOdometry(Instant now) { monitor_.OnInvalidOdometry(now); }

  // To be called 20 times a second.
  Velocity Tick(Instant now);

  const NavigatorStatus& status() const { return status_; }
  // The call that is being answered; nothing when there is none, or it has come to its end.
  std::optional<Call> ActiveCall() const;

 private:
  void Answer(Instant now, const Call& call);
  // What it does to come free, in the order in which it is tried.
  Velocity Drive(Instant now, const Pose2& local_from_base);
  Velocity FindItself(Instant now, const Pose2& local_from_base);
  void StopFindingItself(Instant now);
  Velocity Recover(Instant now, const Pose2& local_from_base);
  void UpdateRoute(Instant now, const Pose2& map_from_base, const RouteGoal& goal);
  bool IsRouteDue(Instant now, const RouteGoal& goal) const;
  void WatchProgress(Instant now, double distance_to_go_m, const Pose2& local_from_base);
  void StartRecovery(Instant now, const Pose2& local_from_base);
  void FollowAgain(Instant now);
  void DropRoute();
  void StartDriving(Instant now);
  void FollowIfGone(Instant now);
  // Ends the call, unless there is another place to look for the tag.
  void GiveUp(Instant now, const std::string& why);
  void ForgetFrame();
  void Finish(NavigatorState state, const std::string& detail);
  void ReportStop(const std::string& reason, const std::string& detail);

  NavigatorOptions options_;
  RoutePlanner planner_;
  PathFollower follower_;
  SafetyMonitor monitor_;
  Surroundings surroundings_;
  Recovery recovery_;
  LocalFrame frame_;
  Destination destination_;
  NavigatorStatus status_;

  Wanderer wanderer_;

  std::optional<Instant> ticked_;
  Instant posed_or_called_;  // when the last pose came, or the call, whichever is later
  std::optional<Instant> finding_since_;
  Utime scan_utime_ = 0;
  std::optional<Pose2> map_from_local_;
  Eigen::Vector2d map_base_ = Eigen::Vector2d::Zero();  // the disc's middle, where known

  std::vector<Eigen::Vector2d> route_;  // local frame; empty: none
  std::optional<RouteGoal> route_goal_;
  std::optional<Instant> planned_;
  bool plan_has_way_ = true;

  std::optional<Instant> blocked_since_;
  std::optional<Instant> moved_at_;  // turning is motion as well
  Pose2 moved_from_;
  std::optional<Instant> drove_at_;
  Eigen::Vector2d drove_from_ = Eigen::Vector2d::Zero();
  double nearest_to_go_m_ = 0.0;
  double no_progress_s_ = 0.0;
  Eigen::Vector2d progress_goal_ = Eigen::Vector2d::Zero();
};

}  // namespace beckon
