#include "tools/evaluation/thesis/robot_eye.hpp"

#include <chrono>
#include <opencv2/imgcodecs.hpp>

#include "common/csv.hpp"
#include "common/jpeg.hpp"
#include "services/ground_detector/jpeg.hpp"

namespace beckon {

using simulation::MakeBox;
using simulation::SolidKind;
using simulation::World;

View RobotEye::Look(const Pose2& map_from_robot) {
  constexpr int kJpegQuality = 88;
  View view;
  const std::vector<std::uint8_t> jpeg =
      EncodeJpeg(renderer_.Render(map_from_robot, {}, frame_++, &view.truth), kJpegQuality);
  const auto start = std::chrono::steady_clock::now();
  view.bgr = DecodeJpeg(jpeg, view.truth.cols, view.truth.rows);
  view.decode_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return view;
}

World BareRoom(std::uint64_t seed, const Eigen::Vector2d& min, const Eigen::Vector2d& max,
               bool open_back) {
  constexpr double kThicknessM = 0.2;
  World world;
  world.seed = seed;
  world.min = min;
  world.max = max;
  world.rooms = {{min, max}};
  const Eigen::Vector2d middle = 0.5 * (min + max);
  const Eigen::Vector2d size = max - min;
  const auto wall = [&](const Eigen::Vector2d& centre, const Eigen::Vector2d& extent) {
    world.solids.push_back(MakeBox("wall " + std::to_string(world.solids.size() + 1),
                                   SolidKind::kWall, {centre.x(), centre.y(), 0.0}, extent,
                                   simulation::kWallHeightM));
  };
  const double length = size.x() + 2.0 * kThicknessM;
  wall({max.x() + 0.5 * kThicknessM, middle.y()}, {kThicknessM, size.y()});
  wall({middle.x(), max.y() + 0.5 * kThicknessM}, {length, kThicknessM});
  wall({middle.x(), min.y() - 0.5 * kThicknessM}, {length, kThicknessM});
  if (!open_back) wall({min.x() - 0.5 * kThicknessM, middle.y()}, {kThicknessM, size.y()});
  return world;
}

void SavePicture(const std::filesystem::path& folder, const std::string& name,
                 const cv::Mat& picture) {
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / name;
  if (!cv::imwrite(file.string(), picture)) throw FileError(file, "cannot be written");
}

}  // namespace beckon
