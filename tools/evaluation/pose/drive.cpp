#include "tools/evaluation/pose/drive.hpp"

#include <chrono>
#include <cmath>
#include <ctime>
#include <deque>
#include <stdexcept>

#include "tools/evaluation/navigation/perception.hpp"
#include "tools/evaluation/navigation/scenarios.hpp"
#include "tools/evaluation/surveyed_site.hpp"
#include "tools/simulation/folders.hpp"
#include "tools/simulation/scripted_drive.hpp"
#include "tools/simulation/simulation.hpp"

namespace beckon {
namespace {

constexpr std::uint64_t kStepsPerOdometry = 2;   // 25 Hz
constexpr std::uint64_t kStepsPerFrame = 5;      // 10 Hz
constexpr std::uint64_t kStepsPerLocation = 25;  // 2 Hz
constexpr double kScanLatencyS = 0.12;
// Of the motion that the ground shows, as evaluate_ground measures it.
constexpr double kGroundMotionNoise = 0.03;

double CpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

class Runner {
 public:
  Runner(std::uint64_t seed, const PoseDriveOptions& options)
      : options_(options),
        world_(ScenarioWorld(Scenario::kFlat, seed), {}, {}),
        driver_(world_.world()),
        perception_(MakeScanPerception(simulation::DefaultCamera(), seed)),
        localizer_(SurveyedSite(world_.world(), {}), {}),
        robot_(localizer_.model(), options.localizer),
        random_(seed, simulation::Stream::kPlaces, 2) {
    drive_.seed = seed;
  }

  PoseDrive Run() {
    drive_.start = DriveAndJudge(options_.find_m);
    is_after_start_ = true;
    DriveAndJudge(options_.track_m);
    if (options_.is_carried) {
      CarryElsewhere();
      drive_.recovery = DriveAndJudge(options_.recover_m);
    }
    drive_.time_s = world_.truth().time_s;
    drive_.cpu_located = cpu_located_s_ / std::max(1e-9, drive_.located_s);
    drive_.cpu_searching = cpu_searching_s_ / std::max(1e-9, drive_.time_s - drive_.located_s);
    return std::move(drive_);
  }

 private:
  Search DriveAndJudge(double distance_m) {
    Search search;
    const double start_m = world_.truth().driven_m;
    const double start_s = world_.truth().time_s;
    while (world_.truth().driven_m - start_m < distance_m &&
           world_.truth().time_s - start_s < options_.max_time_s) {
      Step();
      search.is_located = pose_.has_value();
      search.is_right = pose_ && error_m_ < kRightM && error_deg_ < kRightDeg;
      if (search.is_right && std::isinf(search.found_m)) {
        search.found_m = world_.truth().driven_m - start_m;
        search.found_s = world_.truth().time_s - start_s;
      }
    }
    search.driven_m = world_.truth().driven_m - start_m;
    if (pose_) {
      search.error_m = error_m_;
      search.error_deg = error_deg_;
    }
    return search;
  }

  void CarryElsewhere() {
    const simulation::World& world = world_.world();
    const RobotOptions& robot = world_.base().options().robot;
    const simulation::ClearanceMap map = simulation::MakeClearanceMap(world);
    for (int attempt = 0; attempt < 10'000; ++attempt) {
      const Eigen::Vector2d centre = random_.UniformIn(world.min, world.max);
      const double heading = random_.Uniform(-std::numbers::pi, std::numbers::pi);
      const Eigen::Vector2d way = centre - world_.base().CentreAt(world_.base().map_from_robot());
      if (map.At(centre) < robot.radius_m + 0.15 || way.norm() < 2.0) continue;
      world_.Carry(Pose2{centre.x(), centre.y(), heading} * robot.RobotFromBase().Inverse());
      before_ = world_.truth().map_from_robot;
      driver_ = simulation::ScriptedDrive(world);
      return;
    }
    throw std::runtime_error("no place to carry the robot to");
  }

  void Step() {
    const auto [linear, angular] = driver_.Command(world_);
    world_.Command(linear, angular);
    const auto packets = world_.Step();
    clock_.Advance(std::chrono::microseconds(UtimeFromSeconds(simulation::kStepS)));
    const Instant now = clock_.Now();
    const double cpu_before = CpuSeconds();
    Hear(packets, now);
    Move(now);
    const double cpu_hidden = See(now);
    const double cpu_s = CpuSeconds() - cpu_before - cpu_hidden;
    (pose_ ? cpu_located_s_ : cpu_searching_s_) += cpu_s;
    Judge();
  }

  void Hear(const std::vector<simulation::RadioPacket>& packets, Instant now) {
    for (const simulation::RadioPacket& packet : packets) {
      const Reading reading{now.utime, simulation::kRobotTag, packet.beacon,
                            static_cast<double>(packet.rssi_dbm)};
      if (localizer_.Add(reading, now) == Localizer::Verdict::kAccepted) robot_.AddReading(reading);
    }
    if (world_.steps() % kStepsPerLocation != 0) return;
    for (const TagLocation& location : localizer_.Update(now)) robot_.AddLocation(location);
  }

  void Move(Instant now) {
    const Pose2& truth = world_.truth().map_from_robot;
    if (options_.has_odometry) {
      if (world_.steps() % kStepsPerOdometry != 0) return;
      pose_ = robot_.AddOdometry(now, now.utime, world_.base().odometry_from_robot());
    } else if (world_.steps() % kStepsPerFrame == 0) {
      Pose2 motion = before_.Inverse() * truth;
      const auto noisy = [&](double value) {
        return value * (1.0 + kGroundMotionNoise * random_.Normal());
      };
      motion = {noisy(motion.x), noisy(motion.y), noisy(motion.theta)};
      pose_ = robot_.AddGroundMotion(now, before_utime_, now.utime, motion);
      before_ = truth;
      before_utime_ = now.utime;
    }
  }

  // Returns the processor time of the simulated camera.
  double See(Instant now) {
    const double before = CpuSeconds();
    if (world_.steps() % kStepsPerFrame == 0) {
      const VirtualScan scan = perception_->See(world_, now.utime);
      in_flight_.push_back(
          {now,
           {scan.first_bearing_rad, scan.bearing_step_rad, scan.ranges_m, scan.ground_seen_m}});
    }
    const double hidden = CpuSeconds() - before;
    while (!in_flight_.empty() && SecondsSince(now, in_flight_.front().at) >= kScanLatencyS) {
      robot_.AddScan(now, in_flight_.front().at.utime, in_flight_.front().scan);
      in_flight_.pop_front();
    }
    return hidden;
  }

  void Judge() {
    if (!pose_) return;
    const Pose2 error = world_.truth().map_from_robot.Inverse() * *pose_;
    error_m_ = error.translation().norm();
    error_deg_ = DegreesFromRadians(std::abs(error.theta));
    drive_.located_s += simulation::kStepS;
    if (error_m_ > kWrongM || error_deg_ > kWrongDeg) drive_.wrong_s += simulation::kStepS;
    if (is_after_start_ && world_.steps() % kStepsPerFrame == 0) {
      drive_.errors_m.push_back(error_m_);
      drive_.errors_deg.push_back(error_deg_);
    }
  }

  struct Seen {
    Instant at;
    RangeScan scan;
  };

  const PoseDriveOptions options_;
  simulation::Simulation world_;
  simulation::ScriptedDrive driver_;
  std::unique_ptr<Perception> perception_;
  Localizer localizer_;
  RobotLocalizer robot_;
  simulation::Random random_;
  ManualClock clock_;
  std::deque<Seen> in_flight_;
  Pose2 before_ = world_.truth().map_from_robot;
  Utime before_utime_ = clock_.Now().utime;
  std::optional<Pose2> pose_;  // as it was given last
  double error_m_ = 0.0;
  double error_deg_ = 0.0;
  bool is_after_start_ = false;
  double cpu_located_s_ = 0.0;
  double cpu_searching_s_ = 0.0;
  PoseDrive drive_;
};

}  // namespace

PoseDrive RunPoseDrive(std::uint64_t seed, const PoseDriveOptions& options) {
  return Runner(seed, options).Run();
}

}  // namespace beckon
