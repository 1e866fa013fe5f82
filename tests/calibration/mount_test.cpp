// Calibrations of simulated cameras against the truth, and what is refused.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "common/frames.hpp"
#include "tests/calibration/simulated_camera.hpp"
#include "tools/calibration/mount.hpp"

namespace beckon {
namespace {

using ::testing::HasSubstr;
using testing::SimulatedCamera;

std::string RefusalOf(const std::function<void()>& function) {
  try {
    function();
  } catch (const CalibrationError& error) {
    return error.what();
  }
  return "accepted";
}

// Crosses of tape on the floor, as far as 5 m.
const std::vector<Eigen::Vector2d> kMarks = {{0.8, 0.3}, {0.8, -0.3}, {1.5, 0.6}, {1.5, -0.6},
                                             {2.5, 1.0}, {2.5, -1.0}, {4.0, 1.2}, {4.0, -1.2},
                                             {5.0, 0.0}, {3.0, 0.0}};

// Marks with errors of a tape measure and of clicking, from this seed; 0 for none.
MountInput MarksSeenBy(const SimulatedCamera& camera, std::uint64_t seed) {
  MountInput input;
  input.size = camera.size;
  input.lens = camera.lens;
  cv::RNG random(seed);
  for (const Eigen::Vector2d& place : kMarks) {
    const double metre = seed == 0 ? 0.0 : 0.005;
    const double pixel = seed == 0 ? 0.0 : 0.7;
    FloorMark mark;
    mark.floor_m = place + Eigen::Vector2d(random.gaussian(metre), random.gaussian(metre));
    mark.pixel = camera.PixelOfFloor(place) +
                 Eigen::Vector2d(random.gaussian(pixel), random.gaussian(pixel));
    mark.name = "mark " + std::to_string(input.marks.size() + 1);
    input.marks.push_back(mark);
  }
  return input;
}

// (found - true) / true for a point straight ahead.
double RangeError(const SimulatedCamera& camera, const Mount& mount, double range_m) {
  const Eigen::Vector2d pixel = camera.PixelOfFloor({range_m, 0.0});
  const auto found = mount.camera.GroundFromPixel(mount.camera.Undistorted(pixel));
  return found ? found->norm() / range_m - 1.0 : std::nan("");
}

TEST(SolveMount, MarksWithoutErrorGiveTheTruth) {
  const SimulatedCamera camera;
  const Mount mount = SolveMount(MarksSeenBy(camera, 0));
  EXPECT_NEAR(mount.camera.height_m, camera.height_m, 1e-5);
  EXPECT_NEAR(mount.camera.tilt_down_rad, std::asin(-camera.CameraFromFloor().linear()(2, 2)),
              1e-5);
  EXPECT_NEAR(mount.pan_rad, camera.pan_rad, 1e-5);
  EXPECT_NEAR(mount.roll_rad, camera.roll_rad, 2e-3);  // told about another axis
  EXPECT_LT(mount.rms_px, 1e-3);
  for (int range = 1; range <= 6; ++range) EXPECT_NEAR(RangeError(camera, mount, range), 0.0, 1e-4);
}

TEST(SolveMount, WithoutALensTheFocalLengthIsFound) {
  SimulatedCamera camera;
  camera.lens = {480.0, 480.0, 319.5, 239.5, {}, 0.0};
  MountInput input = MarksSeenBy(camera, 0);
  input.lens.reset();
  const Mount mount = SolveMount(input);
  EXPECT_NEAR(mount.camera.fx, 480.0, 0.1);
  EXPECT_NEAR(mount.camera.height_m, camera.height_m, 1e-4);
  EXPECT_NEAR(RangeError(camera, mount, 6.0), 0.0, 1e-3);
}

// Tape and clicks err as they do; what the calibration says of itself has to hold.
TEST(SolveMount, ItsUncertaintyIsHonest) {
  const SimulatedCamera camera;
  double squares = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Mount mount = SolveMount(MarksSeenBy(camera, seed));
    for (const double range : {1.0, 3.0, 6.0}) {
      const double error = range * RangeError(camera, mount, range) / mount.RangeSigma(range);
      squares += error * error;
      ++count;
      EXPECT_LT(std::abs(error), 4.5) << "seed " << seed << " at " << range;
    }
    EXPECT_LT(std::abs(RangeError(camera, mount, 3.0)), 0.02);
  }
  const double spread = std::sqrt(squares / count);
  EXPECT_GT(spread, 0.6);
  EXPECT_LT(spread, 1.4);
}

TEST(SolveMount, MeasuringFromElsewhereIsToldAndTakenOut) {
  const SimulatedCamera camera;
  MountInput input = MarksSeenBy(camera, 0);
  const Eigen::Vector2d shift(0.3, -0.1);
  for (FloorMark& mark : input.marks) mark.floor_m += shift;
  EXPECT_THAT(RefusalOf([&] { SolveMount(input); }), HasSubstr("camera_at"));
  input.camera_at = shift;
  EXPECT_NEAR(RangeError(camera, SolveMount(input), 4.0), 0.0, 1e-4);
}

TEST(SolveMount, RefusesWhatCannotBe) {
  const SimulatedCamera camera;
  const MountInput good = MarksSeenBy(camera, 0);
  const auto refusal = [&](const std::function<void(MountInput&)>& spoil) {
    MountInput input = good;
    spoil(input);
    return RefusalOf([&] { SolveMount(input); });
  };
  EXPECT_EQ(refusal([](MountInput&) {}), "accepted");
  EXPECT_THAT(refusal([](MountInput& input) { input.marks.resize(3); }), HasSubstr("too few"));
  EXPECT_THAT(refusal([&](MountInput& input) {
                for (std::size_t i = 0; i < input.marks.size(); ++i) {
                  input.marks[i].floor_m = {1.0 + 0.4 * static_cast<double>(i), 0.1};
                  input.marks[i].pixel = camera.PixelOfFloor(input.marks[i].floor_m);
                }
              }),
              HasSubstr("one line"));
  EXPECT_THAT(refusal([&](MountInput& input) {
                for (FloorMark& mark : input.marks) {
                  mark.floor_m = Eigen::Vector2d(1.0, 0.0) + 0.01 * mark.floor_m;
                  mark.pixel = camera.PixelOfFloor(mark.floor_m);
                }
                input.lens.reset();
              }),
              HasSubstr("close together"));
  EXPECT_THAT(refusal([](MountInput& input) {
                for (FloorMark& mark : input.marks) mark.floor_m.y() *= -1.0;
              }),
              HasSubstr("mirrored"));
  EXPECT_THAT(refusal([](MountInput& input) { input.marks[4].floor_m.x() += 0.3; }),
              HasSubstr("mark 5 does not agree"));
  EXPECT_THAT(refusal([](MountInput& input) { input.marks[6].pixel.y() -= 60.0; }),
              HasSubstr("mark 7"));
  EXPECT_THAT(refusal([](MountInput& input) { input.camera_height_m = 0.9; }),
              HasSubstr("0.900 m was measured"));
  EXPECT_THAT(refusal([](MountInput& input) {
                for (FloorMark& mark : input.marks) mark.floor_m = -mark.floor_m;
              }),
              HasSubstr("backwards"));
}

}  // namespace
}  // namespace beckon
