#include "tools/evaluation/navigation/perception.hpp"

#include "services/ground_detector/ground_detector.hpp"
#include "tools/evaluation/navigation/truth_scan.hpp"
#include "tools/simulation/renderer.hpp"

namespace beckon {
namespace {

// What good labels leave over: see the range errors that evaluate_ground reports.
constexpr ScanFaults kCameraFaults{
    .range_noise = 0.01, .pixel_noise = 0.5, .phantom_rate = 0.02, .blind_rate = 0.05};

class ScanPerception : public Perception {
 public:
  ScanPerception(const GroundCamera& camera, std::uint64_t seed)
      : scanner_(camera, kCameraFaults, seed) {}

  VirtualScan See(const simulation::Simulation& world, Utime) override {
    return scanner_.Look([&](double bearing) { return world.Range(bearing); });
  }
  const RayCaster& caster() const override { return scanner_.caster(); }

 private:
  TruthScanner scanner_;
};

GroundDetectorOptions DetectorOptions(const GroundCamera& camera, const RobotOptions& robot) {
  GroundDetectorOptions options;
  options.camera = camera;
  options.robot = robot;
  return options;
}

class CameraPerception : public Perception {
 public:
  CameraPerception(const GroundCamera& camera, const RobotOptions& robot,
                   const simulation::World& world)
      : renderer_(world, camera, {}),
        detector_(DetectorOptions(camera, robot)),
        caster_(camera, {}) {}

  VirtualScan See(const simulation::Simulation& world, Utime utime) override {
    const cv::Mat picture =
        renderer_.Render(world.truth().map_from_robot, world.People(), frame_++);
    const GroundFrame frame = detector_.Process(picture, utime);
    return caster_.Cast(frame.labels, frame.pitch_rad, frame.roll_rad);
  }
  const RayCaster& caster() const override { return caster_; }

 private:
  simulation::Renderer renderer_;
  GroundDetector detector_;
  RayCaster caster_;
  std::uint64_t frame_ = 0;
};

}  // namespace

std::unique_ptr<Perception> MakeScanPerception(const GroundCamera& camera, std::uint64_t seed) {
  return std::make_unique<ScanPerception>(camera, seed);
}

std::unique_ptr<Perception> MakeCameraPerception(const GroundCamera& camera,
                                                 const RobotOptions& robot,
                                                 const simulation::World& world) {
  return std::make_unique<CameraPerception>(camera, robot, world);
}

}  // namespace beckon
