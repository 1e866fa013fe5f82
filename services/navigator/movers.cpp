#include "services/navigator/movers.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace beckon {
namespace {

constexpr double kHoldS = 4.0;
constexpr double kStepM = 0.25;  // the farthest that somebody gets from one scan to the next
constexpr double kSameM = 0.6;   // the same person

}  // namespace

void Movers::Add(double now_s, std::vector<Eigen::Vector2d> suspects) {
  for (const Eigen::Vector2d& at : suspects) {
    const bool confirmed =
        std::any_of(suspects_.begin(), suspects_.end(),
                    [&](const Eigen::Vector2d& other) { return (other - at).norm() < kStepM; });
    if (!confirmed) continue;
    const Mover mover{at, now_s + kHoldS};
    const auto known = std::find_if(movers_.begin(), movers_.end(), [&](const Mover& other) {
      return other.until_s > now_s && (other.at - at).norm() < kSameM;
    });
    if (known != movers_.end()) {
      *known = mover;
    } else {
      movers_.push_back(mover);
    }
  }
  std::erase_if(movers_, [&](const Mover& mover) { return mover.until_s <= now_s; });
  suspects_ = std::move(suspects);
}

double Movers::Nearest(double now_s, const Eigen::Vector2d& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Mover& mover : movers_) {
    if (mover.until_s > now_s) nearest = std::min(nearest, (mover.at - point).norm());
  }
  return nearest;
}

void Movers::Clear() {
  movers_.clear();
  suspects_.clear();
}

}  // namespace beckon
