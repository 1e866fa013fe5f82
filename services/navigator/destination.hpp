// Whom or what the robot is on its way to, and whether it is there.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/navigator/route_planner.hpp"
#include "services/navigator/types.hpp"

namespace beckon {

struct ArrivalOptions {
  // Where the estimate is good the robot stops this far before the caller; the worse it is, the
  // nearer to the estimate it goes.
  double tag_distance_m = 1.0;
  double min_tag_distance_m = 0.4;
  // Where something is in the way, this near to the estimate is near enough.
  double tag_reach_m = 1.6;
  double point_distance_m = 0.15;
  double point_reach_m = 0.6;
  double location_timeout_s = 10.0;
  // After it has arrived, it goes to the tag again when that is farther away than this; 0: never.
  double follow_from_m = 2.5;
};
void ReadArrivalOptions(ConfigTable& table, ArrivalOptions& options);

class Destination {
 public:
  explicit Destination(const ArrivalOptions& options) : options_(options) {}

  // A call to come; the old one is forgotten.
  void Set(const Call& call);
  void Clear();
  void OnLocation(Instant now, const LocatedTag& location);
  void OnPossibleArea(Instant now, const PossibleArea& area);

  // The tag is not where the robot stands, or nothing leads to where it is thought: from now on the
  // goal is the most likely place of the possible area that the robot has not tried yet. False
  // where there is none left; the goal then stays.
  bool TryElsewhere(Instant now, const Eigen::Vector2d& base, const RoutePlanner& plan);
  // The robot has arrived here.
  void NoteArrival(const Eigen::Vector2d& base);
  // Whether the tag has clearly gone since, for long enough to believe it.
  bool HasGone(Instant now, const Eigen::Vector2d& base);

  const std::optional<Call>& call() const { return call_; }
  // Where to go; nothing while the tag has not been located.
  std::optional<RouteGoal> Goal() const;
  // Why the goal cannot be trusted at present; empty where it can.
  std::string Doubt(Instant now) const;

  // Whether the robot may stay here. `is_at_end`: the route ends here, or goes on behind something
  // that does not give way.
  bool HasArrived(const Eigen::Vector2d& base, bool is_at_end, const RoutePlanner& plan) const;

 private:
  struct Heard {
    LocatedTag location;
    Instant at;
  };
  const Heard* CallersLocation() const;
  double StopDistance() const;

  ArrivalOptions options_;
  std::optional<Call> call_;
  std::map<std::string, Heard> heard_;
  std::optional<PossibleArea> area_;  // of the calling tag
  Instant area_at_;
  struct Arrival {
    double distance_m;
    Eigen::Vector2d tag;
    std::optional<Instant> gone_since;
  };
  std::optional<Arrival> arrival_;
  struct Search {
    Eigen::Vector2d place;
    Eigen::Vector2d tag;  // where it was thought when the search began
  };
  std::optional<Search> search_;
  std::vector<Eigen::Vector2d> tried_;
};

}  // namespace beckon
