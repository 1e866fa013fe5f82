#include "services/navigator/messages.hpp"

#include <stdexcept>
#include <string>

#include "common/pose_message.hpp"

namespace beckon {
namespace {

template <typename Message>
void CheckSize(const Message& message, const std::string& what) {
  constexpr int kMaxSide = 4096;  // cells
  if (message.width < 1 || message.width > kMaxSide || message.height < 1 ||
      message.height > kMaxSide) {
    throw std::invalid_argument(what + " of a size that cannot be");
  }
}

}  // namespace

Pose2 CheckedPose(const bot_core::pose_t& message, const std::function<void()>& on_invalid) {
  if (IsPlausible(message)) return PoseFromMessage(message);
  on_invalid();
  throw std::invalid_argument("the pose is not finite or not a rotation");
}

Call CallFromMessage(const call_t& message) {
  Call call;
  call.utime = message.utime;
  call.tag = message.tag;
  call.point = {message.point[0], message.point[1]};
  switch (message.kind) {
    case call_t::TAG:
      call.kind = Call::Kind::kTag;
      break;
    case call_t::POINT:
      call.kind = Call::Kind::kPoint;
      break;
    case call_t::CANCEL:
      call.kind = Call::Kind::kCancel;
      break;
    default:
      throw std::invalid_argument("a call of an unknown kind");
  }
  return call;
}

LocatedTag LocationFromMessage(const location_t& message) {
  LocatedTag location;
  location.utime = message.utime;
  location.tag = message.tag;
  location.is_located = message.status == location_t::OK;
  location.position = {message.position[0], message.position[1]};
  location.covariance << message.covariance[0], message.covariance[1], message.covariance[2],
      message.covariance[3];
  location.area_90_m2 = message.area_90_m2;
  return location;
}

Scan ScanFromMessage(const bot_core::planar_lidar_t& message) {
  return {message.utime, message.rad0, message.radstep, message.ranges, message.intensities};
}

PossibleArea AreaFromMessage(const probability_map_t& message) {
  CheckSize(message, "a possible area");
  PossibleArea area;
  area.utime = message.utime;
  area.tag = message.tag;
  area.grid.origin = {message.origin[0], message.origin[1]};
  area.grid.resolution_m = message.resolution_m;
  area.grid.width = message.width;
  area.grid.height = message.height;
  area.credible_level = message.credible_level;
  return area;
}

SeenGrid GridFromMessage(const occupancy_grid_t& message) {
  CheckSize(message, "a grid");
  SeenGrid grid;
  grid.utime = message.utime;
  grid.grid_from_robot = {message.grid_from_robot[0], message.grid_from_robot[1],
                          message.grid_from_robot[2]};
  grid.grid.resolution_m = message.resolution_m;
  grid.grid.width = message.width;
  grid.grid.height = message.height;
  grid.occupancy = message.occupancy;
  return grid;
}

velocity_command_t MessageFromVelocity(Utime utime, std::int64_t sequence,
                                       const Velocity& velocity) {
  velocity_command_t message{};
  message.utime = utime;
  message.sequence = sequence;
  message.linear_mps = velocity.linear_mps;
  message.angular_radps = velocity.angular_radps;
  return message;
}

navigator_status_t MessageFromStatus(Utime utime, const NavigatorStatus& status) {
  navigator_status_t message{};
  message.utime = utime;
  switch (status.state) {
    case NavigatorState::kIdle:
      message.state = navigator_status_t::IDLE;
      break;
    case NavigatorState::kDriving:
      message.state = navigator_status_t::DRIVING;
      break;
    case NavigatorState::kStopped:
      message.state = navigator_status_t::STOPPED;
      break;
    case NavigatorState::kArrived:
      message.state = navigator_status_t::ARRIVED;
      break;
    case NavigatorState::kGaveUp:
      message.state = navigator_status_t::GAVE_UP;
      break;
  }
  message.stop_reason = status.stop_reason;
  message.detail = status.detail;
  message.tag = status.tag;
  message.has_goal = status.has_goal;
  message.goal[0] = status.goal.x();
  message.goal[1] = status.goal.y();
  message.distance_to_go_m = status.distance_to_go_m;
  message.nearest_obstacle_m = status.nearest_obstacle_m;
  message.route_points = static_cast<std::int32_t>(status.route.size());
  for (const Eigen::Vector2d& point : status.route) message.route.push_back({point.x(), point.y()});
  return message;
}

}  // namespace beckon
