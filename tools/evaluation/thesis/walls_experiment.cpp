#include "tools/evaluation/thesis/walls_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "services/ground_detector/overlay.hpp"
#include "tools/evaluation/thesis/robot_eye.hpp"
#include "tools/simulation/folders.hpp"

namespace beckon {
namespace {

using simulation::Random;
using simulation::Stream;
using simulation::World;

constexpr double kRateHz = 10.0;
// The robot takes the floor right before it for free, so no wall may stand there.
constexpr double kClearanceM = 1.0;

// Its speed and rate of turn wander; steps of a tenth of a second.
const RobotOptions kWalker{.max_speed_mps = 0.6,
                           .max_turn_radps = 1.5,
                           .max_acceleration_mps2 = 0.8,
                           .max_turn_acceleration_radps2 = 3.0};
std::vector<Pose2> RandomPath(const World& world, Random& random) {
  for (;;) {
    Pose2 pose;
    const Eigen::Vector2d start = random.UniformIn(world.min + Eigen::Vector2d(3.0, 0.0),
                                                   world.max - Eigen::Vector2d(1.0, 0.0));
    pose = {start.x(), start.y(), random.Uniform(-0.8, 0.8)};
    double speed_mps = random.Uniform(0.2, 0.5);
    double turn_radps = random.Uniform(-0.4, 0.4);
    std::vector<Pose2> path;
    bool is_free = true;
    while (is_free && path.size() < kUnjudgedFrames + kWallsViews) {
      path.push_back(pose);
      const Eigen::Vector2d centre = pose.translation();
      for (const simulation::Solid& wall : world.solids) {
        is_free = is_free && simulation::Distance(wall, centre) > kClearanceM;
      }
      // All that is in view has to be floor or wall.
      is_free = is_free && std::abs(pose.theta) < 0.9;
      speed_mps = std::clamp(speed_mps + 0.04 * random.Normal(), 0.15, 0.6);
      turn_radps = std::clamp(turn_radps + 0.1 * random.Normal(), -0.6, 0.6);
      pose = pose * Pose2{speed_mps / kRateHz, 0.0, turn_radps / kRateHz};
    }
    if (is_free) return path;
  }
}

GroundScores RunTrial(std::uint64_t seed, const ExperimentOptions& options) {
  Random random(seed, Stream::kLayout);
  const double width_m = random.Uniform(3.0, 5.0);
  const double length_m = random.Uniform(6.0, 8.0);
  const World world =
      BareRoom(seed, {0.0, -0.5 * width_m}, {length_m, 0.5 * width_m}, /*open_back=*/true);
  simulation::RenderOptions look;
  look.one_look = simulation::RandomMottle(random);

  Sequence sequence;
  sequence.name = "walls_" + std::to_string(seed);
  sequence.rate_hz = kRateHz;
  sequence.camera = simulation::DefaultCamera();
  const double half_view = std::atan(0.5 * sequence.camera.width / sequence.camera.fx);
  for (const Pose2& pose : RandomPath(world, random)) {
    SequenceFrame frame;
    frame.utime = UtimeFromSeconds(static_cast<double>(sequence.frames.size() + 1) / kRateHz);
    frame.map_from_robot = pose;
    constexpr int kRays = 121;
    for (int ray = 0; ray < kRays; ++ray) {
      const double bearing = half_view * (1.0 - 2.0 * ray / (kRays - 1.0));
      frame.ranges.push_back(
          {bearing, simulation::CastRay(world.solids, pose.translation(), pose.theta + bearing)});
    }
    sequence.frames.push_back(std::move(frame));
  }

  GroundDetectorOptions detector_options;
  detector_options.camera = sequence.camera;
  detector_options.robot = kWalker;
  detector_options.without = options.without;
  GroundDetector detector(detector_options);
  RobotEye eye(world, sequence.camera, look);
  constexpr double kMaxRangeM = 6.0;
  GroundScorer scorer(sequence, kMaxRangeM);
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    const View view = eye.Look(*sequence.frames[i].map_from_robot);
    const GroundFrame found = detector.Process(view.bgr, sequence.frames[i].utime);
    scorer.Add(i, found, view.truth, view.decode_ms);
    if (!options.pictures.empty() && i + 1 == sequence.frames.size()) {
      SavePicture(options.pictures, sequence.name + ".jpg",
                  DrawOverlay(view.bgr, found.labels, found.features));
    }
  }
  return scorer.Result();
}

}  // namespace

std::vector<GroundScores> RunWallsExperiment(const ExperimentOptions& options) {
  std::vector<GroundScores> trials;
  for (int trial = 0; trial < options.trials; ++trial) {
    trials.push_back(RunTrial(options.seed + static_cast<std::uint64_t>(trial), options));
  }
  return trials;
}

WallsSummary SummariseWalls(const std::vector<GroundScores>& trials) {
  const auto mean = [&](const char* name) {
    double sum = 0.0;
    std::size_t count = 0;
    for (const GroundScores& trial : trials) {
      const auto found = trial.values.find(name);
      if (found == trial.values.end()) continue;
      sum += found->second;
      ++count;
    }
    return sum / static_cast<double>(count);
  };
  WallsSummary summary;
  summary.feature_false_rate = mean("feature_false_rate_mean");
  summary.feature_undetermined = mean("feature_undetermined_mean");
  summary.region_false_rate = mean("region_false_rate_mean");
  summary.undetermined = mean("undetermined");
  summary.range_error = mean("range_error_mean");
  summary.ms = mean("ms_median");
  for (const GroundScores& trial : trials) {
    summary.region_false_rate_worst =
        std::max(summary.region_false_rate_worst, trial.values.at("region_false_rate_max"));
  }
  return summary;
}

}  // namespace beckon
