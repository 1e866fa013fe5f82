#include "services/ground_detector/detector_options.hpp"

#include <filesystem>

namespace beckon {

const std::map<std::string, DetectorPart>& DetectorParts() {
  static const std::map<std::string, DetectorPart> parts = {
      {"alignment", DetectorPart::kAlignment}, {"homography_check", DetectorPart::kHomographyCheck},
      {"n_frame_chain", DetectorPart::kChain}, {"parallax", DetectorPart::kParallax},
      {"colour", DetectorPart::kColour},       {"history", DetectorPart::kHistory},
      {"borders", DetectorPart::kBorders}};
  return parts;
}

GroundDetectorOptions ReadGroundDetectorOptions(ConfigFile& file) {
  GroundDetectorOptions options;
  std::filesystem::path calibration;
  file.Table("camera").RequiredPath("calibration", calibration);
  options.camera = GroundCamera::Load(calibration);
  options.robot = ReadRobotOptions(file);
  ConfigTable& table = file.Table("ground_detector");
  table.Optional("memory_s", options.memory_s, {0.1, 5.0});
  table.Optional("body_rocks", options.body_rocks);
  table.Optional("max_gap_s", options.max_gap_s, {0.1, 10.0});
  table.Optional("fast_threshold", options.features.fast_threshold, {2, 100});
  return options;
}

}  // namespace beckon
