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
constexpr std::uint8_t kArea90Level = 229;  // of 255
constexpr double kTriedM = 1.5;             // places nearer than this are the same place
constexpr std::size_t kMostTried = 10;  // two for each place: where it went and where it stopped
// A tag has gone when it is this much farther away, and from where it was, for so long.
constexpr double kGoneM = 1.0;
constexpr double kGoneS = 2.0;
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
  table.Optional("follow_from_m", options.follow_from_m, Range{0.0, 100.0});
  if (options.min_tag_distance_m > options.tag_distance_m) {
    table.Fail("min_tag_distance_m", "is more than tag_distance_m");
  }
}

void Destination::Set(const Call& call) {
  Clear();
  call_ = call;
}

void Destination::Clear() {
  call_.reset();
  area_.reset();
  arrival_.reset();
  search_.reset();
  tried_.clear();
}

void Destination::OnPossibleArea(Instant now, const PossibleArea& area) {
  if (!call_ || call_->kind != Call::Kind::kTag || call_->tag != area.tag) return;
  area_ = area;
  area_at_ = now;
}

bool Destination::TryElsewhere(Instant now, const Eigen::Vector2d& base, const RoutePlanner& plan) {
  const auto goal = Goal();
  if (!goal || tried_.size() >= kMostTried || !area_ ||
      SecondsSince(now, area_at_) > options_.location_timeout_s)
    return false;
  tried_.push_back(base);
  tried_.push_back(goal->point);
  const auto is_tried = [&](const Eigen::Vector2d& point) {
    return std::any_of(tried_.begin(), tried_.end(), [&](const Eigen::Vector2d& place) {
      return (place - point).norm() < kTriedM && plan.HasLineOfSight(place, point);
    });
  };
  int likeliest = -1;
  for (int cell = 0; cell < area_->grid.size(); ++cell) {
    const auto level = [&](int i) { return area_->credible_level[static_cast<std::size_t>(i)]; };
    if (level(cell) > kArea90Level || (likeliest >= 0 && level(cell) >= level(likeliest))) continue;
    const Eigen::Vector2d point = area_->grid.Centre(cell);
    if (plan.IsFree(point) && !is_tried(point)) likeliest = cell;
  }
  if (likeliest < 0) return false;
  const Heard* heard = CallersLocation();
  search_ = Search{area_->grid.Centre(likeliest), heard->location.position};
  return true;
}

void Destination::NoteArrival(const Eigen::Vector2d& base) {
  const Heard* heard = CallersLocation();
  if (heard == nullptr) return;
  const Eigen::Vector2d& tag = heard->location.position;
  arrival_ = Arrival{(base - tag).norm(), tag, std::nullopt};
}

bool Destination::HasGone(Instant now, const Eigen::Vector2d& base) {
  const Heard* heard = CallersLocation();
  if (!arrival_ || options_.follow_from_m <= 0.0 || heard == nullptr || !Doubt(now).empty()) {
    return false;
  }
  const Eigen::Vector2d& tag = heard->location.position;
  const bool is_gone =
      (tag - base).norm() > std::max(options_.follow_from_m, arrival_->distance_m + kGoneM) &&
      (tag - arrival_->tag).norm() > kGoneM;
  if (!is_gone) arrival_->gone_since.reset();
  if (is_gone && !arrival_->gone_since) arrival_->gone_since = now;
  if (!is_gone || SecondsSince(now, *arrival_->gone_since) < kGoneS) return false;
  arrival_.reset();
  tried_.clear();
  search_.reset();
  return true;
}

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
  // What is searched for is where it was thought until it is thought elsewhere.
  if (search_ && (heard->location.position - search_->tag).norm() < kTriedM) {
    return RouteGoal{search_->place, options_.tag_reach_m};
  }
  return RouteGoal{heard->location.position, options_.tag_reach_m};
}

std::string Destination::Doubt(Instant now) const {
  if (!call_ || call_->kind != Call::Kind::kTag) return stop_reason::kNone;
  const Heard* heard = CallersLocation();
  if (heard == nullptr) return stop_reason::kLocationMissing;
  const double age_s =
      std::max(SecondsSince(now, heard->at), SecondsFromUtime(now.utime - heard->location.utime));
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
  if (goal->point != CallersLocation()->location.position) return false;  // searches
  const Eigen::Matrix2d& covariance = CallersLocation()->location.covariance;
  return distance <= kMaxAreaReachM && covariance.determinant() > 1e-12 &&
         offset.dot(covariance.inverse() * offset) <= kInsideArea;
}

}  // namespace beckon
