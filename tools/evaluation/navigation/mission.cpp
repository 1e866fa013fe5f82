#include "tools/evaluation/navigation/mission.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>

#include "services/navigator/messages.hpp"
#include "services/range_caster/grid_mapper.hpp"
#include "services/rssi_localizer/localizer.hpp"
#include "services/rssi_localizer/messages.hpp"
#include "services/rssi_localizer/robot_localizer.hpp"
#include "tools/evaluation/navigation/perception.hpp"
#include "tools/evaluation/surveyed_site.hpp"
#include "tools/simulation/folders.hpp"
#include "tools/simulation/route.hpp"
#include "tools/simulation/simulation.hpp"

namespace beckon {
namespace {

using std::chrono::microseconds;

constexpr double kCameraRateHz = 10.0;
constexpr double kScanLatencyS = 0.12;  // camera, network, ground detector, range caster
constexpr double kLocationPeriodS = 0.5;
constexpr double kTickS = 0.05;
constexpr double kTrailS = 0.2;
constexpr double kCallAfterS = 3.0;       // the tag has been heard by then
constexpr double kCallAgainAfterS = 0.5;  // since who steps up to the robot stands still
constexpr std::uint64_t kStepsPerOdometry = 2;
constexpr std::uint64_t kStepsPerGrid = 10;

// Whether an event of this period falls into the step that ends at `time_s`.
bool IsDue(double time_s, double period_s) {
  return std::floor((time_s + 1e-9) / period_s) >
         std::floor((time_s - simulation::kStepS + 1e-9) / period_s);
}

RobotLocalizerOptions KnownStart(const simulation::Base& base) {
  RobotLocalizerOptions options;
  options.map_from_odometry = base.map_from_robot() * base.odometry_from_robot().Inverse();
  return options;
}

simulation::BaseOptions BaseFor(const MissionOptions& options) {
  simulation::BaseOptions base{.robot = options.navigator.robot};
  base.odometry_scale_sd *= options.odometry_error;
  base.odometry_turn_scale_sd *= options.odometry_error;
  base.odometry_drift_rad_per_m *= options.odometry_error;
  return base;
}

class Runner {
 public:
  Runner(std::uint64_t seed, const MissionOptions& options)
      : options_(options),
        world_(ScenarioWorld(options.scenario, seed), BaseFor(options), {}),
        perception_(options.use_camera
                        ? MakeCameraPerception(simulation::DefaultCamera(), options.navigator.robot,
                                               world_.world())
                        : MakeScanPerception(simulation::DefaultCamera(), seed)),
        mapper_(perception_->caster(), {}),
        localizer_(SurveyedSite(world_.world(), {}), {}),
        robot_(localizer_.model(), KnownStart(world_.base())),
        navigator_(options.navigator, simulation::SiteOf(world_.world()).plan) {
    mission_.scenario = options.scenario;
    mission_.seed = seed;
    if (options.scenario == Scenario::kStepIn || options.scenario == Scenario::kStepInStanding) {
      visitor_.emplace(options.scenario, seed, options.navigator.robot.radius_m);
    }
  }

  Mission Run() {
    while (!IsOver()) Step();
    Judge();
    return std::move(mission_);
  }

 private:
  double time_s() const { return world_.truth().time_s; }

  bool IsOver() const {
    const NavigatorState state = navigator_.status().state;
    return time_s() > options_.max_time_s || !world_.truth().collisions.empty() ||
           state == NavigatorState::kArrived || state == NavigatorState::kGaveUp;
  }

  void Step() {
    if (visitor_) {
      world_.SetVisitor(
          visitor_->At(world_.truth(), world_.base().CentreAt(world_.base().map_from_robot())));
    }
    const auto packets = world_.Step();
    clock_.Advance(microseconds(UtimeFromSeconds(simulation::kStepS)));
    const Instant now = clock_.Now();
    Hear(packets, now);
    if (world_.steps() % kStepsPerOdometry == 0) {
      const Pose2& odometry = world_.base().odometry_from_robot();
      navigator_.OnOdometry(now, now.utime, odometry);
      mapper_.motion().AddOdometry(now.utime, odometry);
      const auto pose = robot_.AddOdometry(now, now.utime, odometry);
      if (options_.use_true_pose) {
        navigator_.OnPose(now, now.utime, world_.base().map_from_robot());
      } else if (pose) {
        navigator_.OnPose(now, now.utime, *pose);
        const Pose2 error = world_.base().map_from_robot().Inverse() * *pose;
        mission_.pose_error_m = std::max(mission_.pose_error_m, error.translation().norm());
      }
    }
    See(now);
    PressButton(now);
    if (IsDue(time_s(), kTickS)) Tick(now);
    if (IsDue(time_s(), kTrailS)) {
      mission_.trail.push_back(world_.base().CentreAt(world_.base().map_from_robot()));
    }
  }

  void PressButton(Instant now) {
    const bool is_tag =
        options_.scenario == Scenario::kFlat || options_.scenario == Scenario::kDemo;
    const Call call{is_tag ? Call::Kind::kTag : Call::Kind::kPoint, now.utime,
                    is_tag ? simulation::kCallerTag : "", world_.world().caller};
    if (!has_called_ && time_s() > kCallAfterS) {
      has_called_ = true;
      navigator_.OnCall(now, call);
    }
    if (options_.scenario != Scenario::kStepInStanding) return;
    const double x = world_.base().CentreAt(world_.base().map_from_robot()).x();
    if (!has_called_off_ && x > visitor_->start_x_m()) {
      has_called_off_ = true;
      navigator_.OnCall(now, Call{});
    }
    if (!has_called_again_ && visitor_->has_come(time_s() - kCallAgainAfterS)) {
      has_called_again_ = true;
      navigator_.OnCall(now, call);
    }
  }

  void Hear(const std::vector<simulation::RadioPacket>& packets, Instant now) {
    for (const simulation::RadioPacket& packet : packets) {
      const Reading own{now.utime, simulation::kRobotTag, packet.beacon,
                        static_cast<double>(packet.rssi_dbm)};
      if (localizer_.Add(own, now) == Localizer::Verdict::kAccepted) robot_.AddReading(own);
      for (const simulation::HeardTag& heard : packet.heard) {
        localizer_.Add({now.utime, heard.tag, packet.beacon, static_cast<double>(heard.rssi_dbm)},
                       now);
      }
    }
    if (!IsDue(time_s(), kLocationPeriodS)) return;
    for (const TagLocation& location : localizer_.Update(now)) {
      robot_.AddLocation(location);
      navigator_.OnPossibleArea(
          now, AreaFromMessage(MapFromLocation(localizer_.model().grid, location)));
      const bool is_located = location.status == TagLocation::Status::kOk;
      navigator_.OnLocation(now, {location.utime, location.tag, is_located, location.estimate.mean,
                                  location.estimate.covariance, location.estimate.area_90_m2});
    }
  }

  void See(Instant now) {
    if (IsDue(time_s(), 1.0 / kCameraRateHz)) {
      in_flight_.push_back({now, perception_->See(world_, now.utime)});
    }
    const auto latency = microseconds(UtimeFromSeconds(kScanLatencyS));
    while (!in_flight_.empty() && now.steady - in_flight_.front().at.steady >= latency) {
      const Seen seen = std::move(in_flight_.front());
      in_flight_.pop_front();
      navigator_.OnScan(now,
                        {seen.at.utime, seen.scan.first_bearing_rad, seen.scan.bearing_step_rad,
                         seen.scan.ranges_m, seen.scan.ground_seen_m});
      robot_.AddScan(now, seen.at.utime,
                     {seen.scan.first_bearing_rad, seen.scan.bearing_step_rad, seen.scan.ranges_m,
                      seen.scan.ground_seen_m});
      mapper_.AddScan(seen.at.utime, seen.scan);
    }
    if (world_.steps() % kStepsPerGrid == 0 && mapper_.Update()) {
      const OccupancyMap& map = mapper_.map();
      GridGeometry grid;
      grid.resolution_m = map.resolution_m();
      grid.width = grid.height = map.cells();
      navigator_.OnGrid(now, {mapper_.utime(), map.grid_from_robot(), grid, map.Occupancy()});
    }
  }

  void Tick(Instant now) {
    const Velocity velocity = navigator_.Tick(now);
    world_.Command(velocity.linear_mps, velocity.angular_radps);
    CountReversals(velocity);
    const NavigatorStatus& status = navigator_.status();
    if (status.stop_reason != stop_reason_ && !status.stop_reason.empty()) {
      ++mission_.stops[status.stop_reason];
    }
    stop_reason_ = status.stop_reason;
    if (!status.route.empty()) mission_.route = status.route;
  }

  // Small turns to and fro are no weaving.
  void CountReversals(const Velocity& velocity) {
    constexpr double kTurnRadps = 0.15;
    constexpr double kDrivingMps = 0.1;
    if (velocity.linear_mps < kDrivingMps) {
      steered_ = 0.0;
    } else if (std::abs(velocity.angular_radps) > kTurnRadps) {
      if (steered_ * velocity.angular_radps < 0.0) ++mission_.reversals;
      steered_ = velocity.angular_radps;
    }
  }

  // Arrived: within 2 m of the caller, or inside the 90 % area around the estimate.
  bool IsBesideCaller(const Eigen::Vector2d& base) {
    if (world_.truth().to_caller_m <= 2.0) return true;
    for (const auto& location : localizer_.Update(clock_.Now())) {
      if (location.tag != simulation::kCallerTag) continue;
      const Eigen::Vector2d offset = base - location.estimate.mean;
      constexpr double kArea90 = 4.605;  // chi-square, two degrees of freedom
      return offset.dot(location.estimate.covariance.inverse() * offset) <= kArea90;
    }
    return false;
  }

  void Judge() {
    const simulation::Truth& truth = world_.truth();
    const Eigen::Vector2d base = world_.base().CentreAt(world_.base().map_from_robot());
    const NavigatorStatus& status = navigator_.status();
    mission_.time_s = truth.time_s;
    mission_.path_m = truth.driven_m;
    mission_.closest_m = truth.closest_m;
    mission_.closest_to = truth.closest_to;
    mission_.final_distance_m = truth.to_caller_m;
    mission_.reason = status.stop_reason.empty() ? status.detail : status.stop_reason;

    const simulation::ClearanceMap clearance = simulation::MakeClearanceMap(world_.world());
    const double radius = options_.navigator.robot.radius_m;
    const Eigen::Vector2d start = mission_.trail.empty() ? base : mission_.trail.front();
    mission_.shortest_m =
        simulation::LengthOf(simulation::ShortestWay(clearance, start, base, 0.1, radius));
    if (!truth.collisions.empty()) {
      mission_.outcome = "collided";
      mission_.reason = "with " + truth.collisions.front().with;
    } else if (status.state == NavigatorState::kArrived) {
      mission_.outcome = IsBesideCaller(base) ? "arrived" : "elsewhere";
    } else if (status.state == NavigatorState::kGaveUp) {
      const bool has_way =
          !simulation::ShortestWay(clearance, start, world_.world().caller, 1.5, radius).empty();
      mission_.outcome = has_way ? "gave_up" : "unreachable";
    } else {
      mission_.outcome = "timeout";
    }
  }

  struct Seen {
    Instant at;
    VirtualScan scan;
  };

  const MissionOptions options_;
  simulation::Simulation world_;
  std::unique_ptr<Perception> perception_;
  GridMapper mapper_;
  Localizer localizer_;
  RobotLocalizer robot_;
  Navigator navigator_;
  ManualClock clock_;
  std::deque<Seen> in_flight_;
  bool has_called_ = false;
  bool has_called_off_ = false;
  bool has_called_again_ = false;
  std::optional<Visitor> visitor_;
  double steered_ = 0.0;  // rad/s, when it last steered while driving
  std::string stop_reason_;
  Mission mission_;
};

}  // namespace

MissionOptions DefaultMissionOptions(Scenario scenario) {
  MissionOptions options;
  options.navigator.robot = simulation::BaseOptions{}.robot;
  options.scenario = scenario;
  if (scenario == Scenario::kStepIn || scenario == Scenario::kStepInStanding) {
    options.navigator.robot.max_speed_mps = 0.5;
  }
  return options;
}

Mission RunMission(std::uint64_t seed, const MissionOptions& options) {
  return Runner(seed, options).Run();
}

}  // namespace beckon
