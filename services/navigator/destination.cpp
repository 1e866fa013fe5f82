#include "services/navigator/destination.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "services/navigator/stop_reasons.hpp"

namespace beckon {
namespace {

constexpr std::size_t kMaxTags = 4096;
// Squared Mahalanobis distance that holds 80 % of a plane Gaussian: inside the 90 % area with a
// margin.
constexpr double kInsideArea = 3.2;
// Being inside a vast area says little about being beside the caller.
constexpr double kMaxAreaReachM = 2.5;
// The route ends within the reach, the robot about there.
constexpr double kEndM = 0.2;

}  // namespace

void ReadArrivalOptions(ConfigTable& table, ArrivalOptions& options) {
  table.Optional("tag_distance_m", options.tag_distance_m, Range{0.1, 2.0});
  table.Optional("min_tag_distance_m", options.min_tag_distance_m, Range{0.1, 2.0});
  table.Optional("tag_reach_m", options.tag_reach_m, Range{0.1, 2.0});
  table.Optional("point_distance_m", options.point_distance_m, Range{0.05, 5.0});
  table.Optional("point_reach_m", options.point_reach_m, Range{0.05, 5.0});
  table.Optional("location_timeout_s", options.location_timeout_s, Range{1.0, 3600.0});
  if (options.min_tag_distance_m > options.tag_distance_m) {
    table.Fail("min_tag_distance_m", "is more than tag_distance_m");
  }
}

void Destination::Set(const Call& call) { call_ = call; }

void Destination::OnLocation(Instant now, const LocatedTag& location) {
  // A tag that is not located keeps its last place, which grows old.
  if (!location.is_located) return;
  if (heard_.size() >= kMaxTags && !heard_.contains(location.tag)) {
    heard_.erase(std::min_element(heard_.begin(), heard_.end(), [](const auto& a, const auto& b) {
      return a.second.at.steady < b.second.at.steady;
    }));
  }
  heard_[location.tag] = {location, now};
}

const Destination::Heard* Destination::CallersLocation() const {
  if (!call_ || call_->kind != Call::Kind::kTag) return nullptr;
  const auto found = heard_.find(call_->tag);
  return found == heard_.end() ? nullptr : &found->second;
}

std::optional<RouteGoal> Destination::Goal() const {
  if (!call_) return std::nullopt;
  if (call_->kind == Call::Kind::kPoint) return RouteGoal{call_->point, options_.point_reach_m};
  const Heard* heard = CallersLocation();
  if (heard == nullptr) return std::nullopt;
  return RouteGoal{heard->location.position, options_.tag_reach_m};
}

std::string Destination::Doubt(Instant now) const {
  if (!call_ || call_->kind != Call::Kind::kTag) return stop_reason::kNone;
  const Heard* heard = CallersLocation();
  if (heard == nullptr) return stop_reason::kLocationMissing;
  const double age_s = std::chrono::duration<double>(now.steady - heard->at.steady).count();
  return age_s > options_.location_timeout_s ? stop_reason::kLocationStale : stop_reason::kNone;
}

double Destination::StopDistance() const {
  if (call_->kind == Call::Kind::kPoint) return options_.point_distance_m;
  // The 90 % area as a disc: its radius is what the caller may be beyond the estimate.
  const double uncertainty_m = std::sqrt(CallersLocation()->location.area_90_m2 / std::numbers::pi);
  return std::clamp(options_.tag_reach_m - 0.6 * uncertainty_m, options_.min_tag_distance_m,
                    options_.tag_distance_m);
}

bool Destination::HasArrived(const Eigen::Vector2d& base, bool is_at_end,
                             const RoutePlanner& plan) const {
  const auto goal = Goal();
  if (!goal) return false;
  const Eigen::Vector2d offset = base - goal->point;
  const double distance = offset.norm();
  if (distance <= StopDistance() && plan.HasLineOfSight(goal->point, base)) return true;
  if (!is_at_end) return false;
  if (distance <= goal->reach_m + kEndM) return true;
  if (call_->kind == Call::Kind::kPoint) return false;
  const Eigen::Matrix2d& covariance = CallersLocation()->location.covariance;
  return distance <= kMaxAreaReachM && covariance.determinant() > 1e-12 &&
         offset.dot(covariance.inverse() * offset) <= kInsideArea;
}

}  // namespace beckon
