#include "services/navigator/recovery.hpp"

#include <cmath>
#include <numbers>

namespace beckon {
namespace {

constexpr int kMaxAttempts = 6;
constexpr double kFreeAgainM = 0.7;
constexpr double kTightM = 0.15;
constexpr double kBackOutM = 0.4;
constexpr double kBackOutMps = 0.12;
constexpr double kMovingM = 0.05;  // it has begun to back out
constexpr double kFacedRad = 0.1;

}  // namespace

bool Recovery::Start(const Pose2& local_from_base, const Surroundings& surroundings) {
  if (attempts_ >= kMaxAttempts) return false;
  // Where it stands close to things, turning shows little that it does not know: back first.
  if (attempts_ == 0) {
    const double around = surroundings.Clearance(local_from_base.translation()) - robot_.radius_m;
    is_back_next_ = around < kTightM;
  }
  ++attempts_;
  from_ = local_from_base;
  const auto heading =
      is_back_next_ ? HeadingToBackOut(local_from_base, surroundings) : std::optional<double>();
  if (heading) {
    maneuver_ = Maneuver::kBackOut;
    back_out_heading_rad_ = *heading;
  } else {
    StartLookingAround(local_from_base);
  }
  is_back_next_ = is_looking_around();  // which may have shown the way back
  return true;
}

void Recovery::StartLookingAround(const Pose2& local_from_base) {
  maneuver_ = Maneuver::kLookAround;
  last_heading_rad_ = local_from_base.theta;
  turned_rad_ = 0.0;
}

void Recovery::NoteProgress(const Pose2& local_from_base) {
  if ((local_from_base.translation() - from_.translation()).norm() > kFreeAgainM) attempts_ = 0;
}

std::string Recovery::Description() const {
  if (!maneuver_) return "";
  return is_looking_around() ? "looking around" : "backing out";
}

std::optional<Velocity> Recovery::Continue(const Pose2& local_from_base,
                                           const Surroundings& surroundings) {
  if (!maneuver_) return std::nullopt;
  const auto velocity =
      is_looking_around() ? LookAround(local_from_base) : BackOut(local_from_base, surroundings);
  if (!velocity) maneuver_.reset();
  return velocity;
}

std::optional<Velocity> Recovery::LookAround(const Pose2& local_from_base) {
  turned_rad_ += std::abs(WrapAngle(local_from_base.theta - last_heading_rad_));
  last_heading_rad_ = local_from_base.theta;
  const double left = 2.0 * std::numbers::pi - turned_rad_;
  if (left < kFacedRad) return std::nullopt;
  return Velocity{0.0, follower_.TurnRate(left)};
}

std::optional<Velocity> Recovery::BackOut(const Pose2& local_from_base,
                                          const Surroundings& surroundings) {
  const double gone = (local_from_base.translation() - from_.translation()).norm();
  const double to_turn = WrapAngle(back_out_heading_rad_ - local_from_base.theta);
  if (gone < kMovingM && std::abs(to_turn) > kFacedRad) {
    return Velocity{0.0, follower_.TurnRate(to_turn)};
  }
  const double left = kBackOutM - gone;
  const double look = left + monitor_.StoppingDistance(kBackOutMps);
  if (left < kMovingM || FreeBehind(local_from_base, surroundings, look) < look) {
    return std::nullopt;
  }
  return Velocity{-kBackOutMps, 0.0};
}

double Recovery::FreeBehind(const Pose2& local_from_base, const Surroundings& surroundings,
                            double distance_m) const {
  return LookAlong(surroundings, robot_, local_from_base, 0.0, -1, distance_m, margin_m_)
      .Passable();
}

// Between the posts of a door there may be no way straight back, but one a little aside: a disc can
// turn until it has its back to that. Nothing where it is hemmed in.
std::optional<double> Recovery::HeadingToBackOut(const Pose2& local_from_base,
                                                 const Surroundings& surroundings) const {
  constexpr int kHeadings = 6;  // to each side
  constexpr double kStepRad = std::numbers::pi / 9.0;
  const double look = kBackOutM + monitor_.StoppingDistance(kBackOutMps);
  for (int i = 0; i <= kHeadings; ++i) {
    for (const int side : {1, -1}) {
      Pose2 turned = local_from_base;
      turned.theta = WrapAngle(turned.theta + side * i * kStepRad);
      if (FreeBehind(turned, surroundings, look) >= look) return turned.theta;
    }
  }
  return std::nullopt;
}

}  // namespace beckon
