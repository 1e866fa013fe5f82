#include "tools/simulation/live_robot.hpp"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

#include "beckon/call_t.hpp"
#include "beckon/velocity_command_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "common/jpeg.hpp"
#include "common/log.hpp"
#include "common/message_bus.hpp"
#include "common/pose_message.hpp"
#include "common/robot_file.hpp"
#include "tools/simulation/camera_server.hpp"
#include "tools/simulation/renderer.hpp"
#include "tools/simulation/simulation.hpp"
#include "tools/simulation/xbee_port.hpp"

namespace beckon::simulation {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr microseconds kWorldStep{static_cast<std::int64_t>(1e6 * kStepS)};
constexpr std::uint64_t kStepsPerOdometry = 2;  // 25 Hz
constexpr std::uint64_t kStepsPerReport = 50;   // 1 Hz
constexpr std::uint64_t kStepsPerPress =
    15 * kStepsPerReport;  // how long a caller waits for a reaction
constexpr microseconds kLongestLag = milliseconds(500);
constexpr std::size_t kMaxFrameBytes = 60'000;  // leaves room in a datagram of 64 KB

// What a camera needs of the world at one moment.
struct Snapshot {
  Utime utime = 0;
  Pose2 map_from_robot;
  std::vector<Solid> people;
};

// With the quality lowered step by step until the frame takes no more than `max_bytes`.
std::vector<std::uint8_t> EncodeWithin(const cv::Mat& image, int quality, std::size_t max_bytes) {
  constexpr int kStep = 8;
  constexpr int kLowest = 40;
  std::vector<std::uint8_t> jpeg = EncodeJpeg(image, quality);
  while (jpeg.size() > max_bytes && quality - kStep >= kLowest) {
    quality -= kStep;
    jpeg = EncodeJpeg(image, quality);
  }
  return jpeg;
}

class LiveRobot {
 public:
  LiveRobot(const World& world, const LiveOptions& options)
      : options_(options),
        simulation_(world, options.base, options.radio),
        renderer_(world, options.camera, RenderOptions{}),
        bus_(options.lcm_url),
        server_(options.http_port),
        xbee_(options.xbee_link) {
    if (!options_.truth_file.empty()) {
      truth_file_.open(options_.truth_file);
      if (!truth_file_) throw std::runtime_error("cannot write " + options_.truth_file.string());
    }
    bus_.Subscribe<velocity_command_t>(channels::kDrive, [this](const velocity_command_t& command) {
      simulation_.Command(command.linear_mps, command.angular_radps);  // not finite: a stop
      const bool is_finite =
          std::isfinite(command.linear_mps) && std::isfinite(command.angular_radps);
      if (!is_finite) throw std::invalid_argument("the command is not finite: the base stops");
    });
  }

  void Run(const std::atomic<bool>& stop) {
    LogInfo("camera at http://127.0.0.1:" + std::to_string(server_.port()) + "/stream, radio at " +
            options_.xbee_link.string());
    TakeSnapshot(clock_.Now().utime);
    std::jthread camera([this](const std::stop_token& token) { Film(token); });
    Instant due = clock_.Now();
    while (!stop) {
      const auto wait = std::chrono::ceil<milliseconds>(due.steady - clock_.Now().steady);
      bus_.Dispatch(std::max(milliseconds(0), wait));
      const Instant now = clock_.Now();
      if (now.steady < due.steady) continue;
      if (now.steady - due.steady > kLongestLag)
        due = now;  // was suspended: time has not passed here
      Step(due.utime);
      due.utime += kWorldStep.count();
      due.steady += kWorldStep;
    }
    Report(true);
  }

 private:
  void Step(Utime utime) {
    for (const RadioPacket& packet : simulation_.Step()) xbee_.Write(XbeeBytes(packet));
    TakeSnapshot(utime);
    const std::uint64_t step = simulation_.steps();
    if (step % kStepsPerOdometry == 0) {
      const Base& base = simulation_.base();
      bus_.Publish(channels::kOdometry, MessageFromPose(utime, base.odometry_from_robot(),
                                                        base.speed_mps(), base.turn_radps()));
    }
    if (step % kStepsPerReport == 0) Report(false);
    PressButton(step, utime);
  }

  // Presses again when nothing moves for a while, as people do.
  void PressButton(std::uint64_t step, Utime utime) {
    if (options_.call_after_s < 0.0) return;
    const auto first = static_cast<std::uint64_t>(std::llround(options_.call_after_s / kStepS)) + 1;
    if (step < first || (step - first) % kStepsPerPress != 0) return;
    if (step > first && simulation_.truth().driven_m > 0.05) return;
    call_t call{};
    call.utime = utime;
    call.kind = call_t::TAG;
    call.tag = kCallerTag;
    bus_.Publish(channels::kCall, call);
    LogInfo("the caller presses the button");
  }

  void Report(bool is_last) {
    const Truth& truth = simulation_.truth();
    const Pose2& pose = truth.map_from_robot;
    const auto rounded = [](double value) { return std::round(1e3 * value) / 1e3; };
    nlohmann::json collisions = nlohmann::json::array();
    for (const Collision& collision : truth.collisions) {
      collisions.push_back({{"time_s", rounded(collision.time_s)},
                            {"with", collision.with},
                            {"x_m", rounded(collision.place.x())},
                            {"y_m", rounded(collision.place.y())}});
    }
    const Eigen::Vector2d& caller = simulation_.world().caller;
    const nlohmann::json line = {{"time_s", rounded(truth.time_s)},
                                 {"pose", {rounded(pose.x), rounded(pose.y), rounded(pose.theta)}},
                                 {"speed_mps", rounded(truth.speed_mps)},
                                 {"turn_radps", rounded(truth.turn_radps)},
                                 {"caller", {rounded(caller.x()), rounded(caller.y())}},
                                 {"distance_to_caller_m", rounded(truth.to_caller_m)},
                                 {"nearest_m", rounded(truth.nearest_m)},
                                 {"closest_approach_m", rounded(truth.closest_m)},
                                 {"closest_to", truth.closest_to},
                                 {"path_length_m", rounded(truth.driven_m)},
                                 {"collisions", truth.collisions.size()},
                                 {"collision_list", collisions},
                                 {"summary", is_last}};
    std::cout << line.dump() << std::endl;
    if (truth_file_.is_open()) truth_file_ << line.dump() << std::endl;
  }

  void TakeSnapshot(Utime utime) {
    const std::lock_guard lock(snapshot_mutex_);
    snapshot_ = {utime, simulation_.truth().map_from_robot, simulation_.People()};
  }

  void Film(const std::stop_token& token) {
    const auto period = microseconds(std::llround(1e6 / options_.camera_rate_hz));
    auto due = std::chrono::steady_clock::now();
    Utime last = 0;
    for (std::uint64_t frame = 0; !token.stop_requested(); ++frame) {
      Snapshot snapshot;
      {
        const std::lock_guard lock(snapshot_mutex_);
        snapshot = snapshot_;
      }
      if (snapshot.utime != last) {  // the world may be late on a busy machine
        last = snapshot.utime;
        const cv::Mat image = renderer_.Render(snapshot.map_from_robot, snapshot.people, frame);
        server_.Show(snapshot.utime, EncodeWithin(image, options_.jpeg_quality, kMaxFrameBytes));
      }
      due = std::max(due + period, std::chrono::steady_clock::now());
      std::this_thread::sleep_until(due);
    }
  }

  const LiveOptions options_;
  const SystemClock clock_;
  Simulation simulation_;
  // Paints its floor, which takes a while, before any device is there to be opened.
  Renderer renderer_;
  MessageBus bus_;
  CameraServer server_;
  XbeePort xbee_;
  std::ofstream truth_file_;
  std::mutex snapshot_mutex_;
  Snapshot snapshot_;
};

}  // namespace

WorldOptions ReadWorldOptions(ConfigFile& file) {
  WorldOptions world;
  const RobotOptions robot = ReadRobotOptions(file);
  world.robot_radius_m = robot.radius_m;
  world.robot_centre_x_m = robot.centre_x_m;
  file.Table("simulate_robot").Optional("walking_people", world.walking_people, Range{0, 5});
  return world;
}

LiveOptions ReadLiveOptions(ConfigFile& file) {
  LiveOptions options;
  options.world = ReadWorldOptions(file);
  options.lcm_url = ReadLcmUrl(file);
  std::filesystem::path calibration;
  file.Table("camera").RequiredPath("calibration", calibration);
  options.camera = GroundCamera::Load(calibration);

  options.base.robot = ReadRobotOptions(file);

  ConfigTable& own = file.Table("simulate_robot");
  own.Optional("http_port", options.http_port, Range{0, 65535});
  own.OptionalPath("xbee_link", options.xbee_link);
  own.Optional("camera_rate_hz", options.camera_rate_hz, Range{0.5, 60.0});
  own.Optional("jpeg_quality", options.jpeg_quality, Range{40, 100});
  own.Optional("odometry_scale_sd", options.base.odometry_scale_sd, Range{0.0, 0.5});
  own.Optional("odometry_turn_scale_sd", options.base.odometry_turn_scale_sd, Range{0.0, 0.5});
  own.Optional("odometry_drift_rad_per_m", options.base.odometry_drift_rad_per_m, Range{0.0, 1.0});
  own.Optional("packet_loss", options.radio.packet_loss, Range{0.0, 1.0});
  return options;
}

void RunLive(const World& world, const LiveOptions& options, const std::atomic<bool>& stop) {
  LiveRobot robot(world, options);
  robot.Run(stop);
}

}  // namespace beckon::simulation
