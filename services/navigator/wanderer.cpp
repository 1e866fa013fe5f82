#include "services/navigator/wanderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace beckon {
namespace {

constexpr int kDirections = 36;
constexpr double kLongestM = 2.0;   // of one leg: from its end more is seen
constexpr double kShortestM = 0.4;  // shorter ones show nothing new
constexpr double kKeepM = 0.2;      // of the free way, before whatever ends it
constexpr std::size_t kMostPlaces = 200;

}  // namespace

std::optional<Eigen::Vector2d> Wanderer::NextPlace(const Pose2& local_from_base,
                                                   const Surroundings& surroundings) {
  if (been_.size() < kMostPlaces) been_.push_back(local_from_base.translation());
  std::optional<Eigen::Vector2d> best;
  double best_m = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < kDirections; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / kDirections;
    const Pose2 turned = local_from_base * Pose2{0.0, 0.0, turn};
    const ArcView view =
        LookAlong(surroundings, robot_, turned, 0.0, 1, kLongestM + kKeepM, margin_m_);
    const double way = view.Passable() - kKeepM;
    if (way < kShortestM) continue;
    const Eigen::Vector2d place = turned * Eigen::Vector2d(way, 0.0);
    double from_known_m = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& known : been_) {
      from_known_m = std::min(from_known_m, (place - known).norm());
    }
    if (from_known_m > best_m) {
      best_m = from_known_m;
      best = place;
    }
  }
  if (best && been_.size() < kMostPlaces) been_.push_back(*best);
  return best;
}

}  // namespace beckon
