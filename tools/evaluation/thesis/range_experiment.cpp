#include "tools/evaluation/thesis/range_experiment.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

#include "common/statistics.hpp"
#include "services/ground_detector/overlay.hpp"
#include "services/range_caster/ray_caster.hpp"
#include "tools/evaluation/thesis/robot_eye.hpp"
#include "tools/simulation/folders.hpp"

namespace beckon {
namespace {

using simulation::Random;
using simulation::Stream;
using simulation::World;

constexpr double kRateHz = 10.0;
constexpr double kStepM = 0.04;  // a frame
constexpr int kFramesARow = 10;  // 0.4 m
constexpr int kRows = 12;        // 6.0, 5.6, ... 1.6 m
constexpr double kFarthestM = 6.0;
constexpr int kLeadFrames = 13;  // before the first distance, so that a second is remembered

struct Ray {
  double found_m;
  double true_m;
};
// From picture to scan, as the services do it, and what it answers in all trials.
class Chain {
 public:
  explicit Chain(const GroundDetectorOptions& options)
      : options_(options), caster_(options.camera, {}) {}

  void StartTrial() { detector_.emplace(options_); }

  struct Answer {
    GroundFrame ground;
    VirtualScan scan;
  };
  Answer Process(const View& view, Utime utime) {
    const auto start = std::chrono::steady_clock::now();
    Answer answer;
    answer.ground = detector_->Process(view.bgr, utime);
    answer.scan =
        caster_.Cast(answer.ground.labels, answer.ground.pitch_rad, answer.ground.roll_rad);
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    ms_.push_back(view.decode_ms + ms.count());
    return answer;
  }

  void Add(int row, std::vector<Ray> rays) {
    std::vector<Ray>& all = rows_[static_cast<std::size_t>(row)];
    all.insert(all.end(), rays.begin(), rays.end());
  }
  RangeTable Table() const;

 private:
  GroundDetectorOptions options_;
  RayCaster caster_;
  std::optional<GroundDetector> detector_;
  std::vector<std::vector<Ray>> rows_ = std::vector<std::vector<Ray>>(kRows);  // farthest first
  std::vector<double> ms_;
};

RangeRow Summarise(double distance_m, const std::vector<Ray>& rays) {
  RangeRow row;
  row.distance_m = distance_m;
  double finite = 0.0;
  double missed = 0.0;
  for (const Ray& ray : rays) {
    const double error = (ray.found_m - ray.true_m) / ray.true_m;
    if (!(std::abs(error) <= 0.2)) missed += 1.0;
    if (!std::isfinite(error)) continue;
    finite += 1.0;
    row.error += std::abs(error);
    row.bias += error;
    row.worst = std::max(row.worst, std::abs(error));
  }
  row.error /= finite;
  row.bias /= finite;
  row.missed = missed / static_cast<double>(rays.size());
  return row;
}

RangeTable Chain::Table() const {
  RangeTable table;
  for (int row = kRows - 1; row >= 0; --row) {
    table.rows.push_back(
        Summarise(kFarthestM - row * kFramesARow * kStepM, rows_[static_cast<std::size_t>(row)]));
  }
  table.ms_median = Quantile(ms_, 0.5);
  table.ms_p95 = Quantile(ms_, 0.95);
  return table;
}

// A hall with the box's face at x = 0, seen from smaller x.
struct Scene {
  World world;
  std::size_t box = 0;  // among the solids
  double lane_y_m = 0.0;
  double heading_rad = 0.0;

  // Where the robot is when the face is this far ahead.
  Pose2 PoseAt(double distance_m) const {
    return {-distance_m, lane_y_m - std::tan(heading_rad) * distance_m, heading_rad};
  }
};

Scene MakeScene(std::uint64_t seed) {
  Random random(seed, Stream::kLayout);
  const double half_width_m = random.Uniform(1.5, 2.5);
  Scene scene;
  scene.world = BareRoom(seed, {-7.5, -half_width_m}, {random.Uniform(1.0, 2.5), half_width_m},
                         /*open_back=*/false);
  const double width_m = random.Uniform(0.4, 0.8);
  const double height_m = random.Uniform(0.3, 1.2);
  constexpr double kDepthM = 0.4;
  scene.box = scene.world.solids.size();
  scene.world.solids.push_back(simulation::MakeBox("object", simulation::SolidKind::kFurniture,
                                                   {0.5 * kDepthM, 0.0, 0.0}, {kDepthM, width_m},
                                                   height_m));
  scene.lane_y_m = random.Uniform(-0.1, 0.1);
  scene.heading_rad = random.Uniform(-0.05, 0.05);
  return scene;
}

// The rays that meet the object, by truth.
std::vector<Ray> RaysAtObject(const Scene& scene, const Pose2& pose, const VirtualScan& scan) {
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
    const double bearing = pose.theta + scan.Bearing(i);
    const double true_m = simulation::CastRay(scene.world.solids, pose.translation(), bearing);
    const auto crossing = simulation::Cross(scene.world.solids[scene.box], pose.translation(),
                                            Eigen::Vector2d(std::cos(bearing), std::sin(bearing)));
    if (crossing && crossing->enter_m <= true_m) {
      rays.push_back({static_cast<double>(scan.ranges_m[i]), true_m});
    }
  }
  return rays;
}

void RunTrial(std::uint64_t seed, const GroundCamera& camera, const std::filesystem::path& pictures,
              Chain& full, Chain& tenth) {
  const Scene scene = MakeScene(seed);
  RobotEye eye(scene.world, camera, {});
  full.StartTrial();
  tenth.StartTrial();
  for (int frame = 0; frame <= kLeadFrames + (kRows - 1) * kFramesARow; ++frame) {
    const double distance_m = kFarthestM + (kLeadFrames - frame) * kStepM;
    const Pose2 pose = scene.PoseAt(distance_m);
    const View view = eye.Look(pose);
    const Utime utime = UtimeFromSeconds((frame + 1) / kRateHz);
    const Chain::Answer fine = full.Process(view, utime);
    const Chain::Answer coarse = tenth.Process(view, utime);
    if (frame < kLeadFrames || (frame - kLeadFrames) % kFramesARow != 0) continue;
    const int row = (frame - kLeadFrames) / kFramesARow;
    full.Add(row, RaysAtObject(scene, pose, fine.scan));
    tenth.Add(row, RaysAtObject(scene, pose, coarse.scan));
    if (!pictures.empty()) {
      char name[64];
      std::snprintf(name, sizeof(name), "range_%llu_%.1fm.jpg",
                    static_cast<unsigned long long>(seed), distance_m);
      SavePicture(pictures, name, DrawOverlay(view.bgr, fine.ground.labels, fine.ground.features));
    }
  }
}

}  // namespace

double RangeTable::MeanError(double from_m, double to_m) const {
  double sum = 0.0;
  double count = 0.0;
  for (const RangeRow& row : rows) {
    if (row.distance_m < from_m - 1e-6 || row.distance_m > to_m + 1e-6) continue;
    sum += row.error;
    count += 1.0;
  }
  return sum / count;
}

RangeExperiment RunRangeExperiment(const ExperimentOptions& options) {
  GroundDetectorOptions detector;
  detector.camera = simulation::DefaultCamera();
  detector.without = options.without;
  Chain full(detector);
  detector.without.insert(DetectorPart::kBorders);
  Chain tenth(detector);
  for (int trial = 0; trial < options.trials; ++trial) {
    RunTrial(options.seed + static_cast<std::uint64_t>(trial), detector.camera, options.pictures,
             full, tenth);
  }
  return {full.Table(), tenth.Table()};
}

}  // namespace beckon
