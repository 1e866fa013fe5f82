#include "tools/evaluation/ground/evaluate.hpp"

#include <chrono>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "common/csv.hpp"
#include "services/ground_detector/jpeg.hpp"
#include "services/ground_detector/overlay.hpp"

namespace beckon {
namespace {

std::vector<std::uint8_t> ReadBytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file),
                                  std::istreambuf_iterator<char>()};
  if (!file.good() && bytes.empty()) throw FileError(path, "cannot be read");
  return bytes;
}

// Standard deviation of where the wheels are under the camera, in camera heights.
constexpr double kCentreSigma = 0.3;

// What carries the camera is not told: a car has its camera higher up than a small robot, and is
// faster.
RobotOptions CarrierOf(const GroundCamera& camera, const GroundEvaluationOptions& options) {
  RobotOptions carrier;
  carrier.max_speed_mps = options.max_speed_heights * camera.height_m;
  carrier.max_turn_radps = 1.5;
  carrier.max_acceleration_mps2 = camera.height_m;
  return carrier;
}

cv::Mat ReadTruth(const std::filesystem::path& path, const GroundCamera& camera) {
  if (path.empty()) return {};
  cv::Mat truth = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
  if (truth.cols != camera.width || truth.rows != camera.height) {
    throw FileError(path, "is not a picture of the camera's size");
  }
  return truth;
}

}  // namespace

GroundScores EvaluateSequence(const std::filesystem::path& folder,
                              const GroundEvaluationOptions& options) {
  const Sequence sequence = LoadSequence(folder);
  GroundDetectorOptions detector_options;
  detector_options.camera = sequence.camera;
  detector_options.robot = CarrierOf(sequence.camera, options);
  detector_options.filter.centre_sigma_m = kCentreSigma * sequence.camera.height_m;
  detector_options.without = options.without;
  GroundDetector detector(detector_options);
  GroundScorer scorer(sequence, options.max_range_m);
  std::filesystem::path overlay;
  if (!options.overlay.empty()) {
    overlay = options.overlay / sequence.name;
    std::filesystem::create_directories(overlay);
  }

  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    const SequenceFrame& frame = sequence.frames[i];
    const std::vector<std::uint8_t> jpeg = ReadBytes(frame.picture);
    const auto start = std::chrono::steady_clock::now();
    cv::Mat bgr;
    try {
      bgr = DecodeJpeg(jpeg, sequence.camera.width, sequence.camera.height);
    } catch (const std::invalid_argument& error) {
      throw FileError(frame.picture, error.what());
    }
    const std::chrono::duration<double, std::milli> decoding =
        std::chrono::steady_clock::now() - start;
    const GroundFrame found = detector.Process(bgr, frame.utime);
    scorer.Add(i, found, ReadTruth(frame.truth, sequence.camera), decoding.count());
    if (!overlay.empty()) {
      const auto picture = overlay / frame.picture.stem().concat(".jpg");
      if (!cv::imwrite(picture.string(), DrawOverlay(bgr, found.labels, found.features))) {
        throw FileError(picture, "cannot be written");
      }
    }
  }
  return scorer.Result();
}

std::string ScoresAsJson(const std::vector<GroundScores>& scores) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const GroundScores& score : scores) {
    nlohmann::ordered_json object;
    object["sequence"] = score.sequence;
    object["frames"] = score.frames;
    for (const auto& [name, value] : score.values) object[name] = value;
    for (const auto& [stage, ms] : score.stage_ms) object["ms_" + stage] = ms;
    list.push_back(std::move(object));
  }
  return (list.size() == 1 ? list.front() : list).dump() + "\n";
}

std::string ScoresAsTable(const std::vector<GroundScores>& scores) {
  struct Row {
    const char* name;
    double factor;
    const char* unit;
  };
  static constexpr Row kRows[] = {{"region_false_rate_mean", 100, "%"},
                                  {"region_false_rate_max", 100, "%"},
                                  {"ground_recall", 100, "%"},
                                  {"obstacle_as_ground", 100, "%"},
                                  {"undetermined", 100, "%"},
                                  {"feature_false_rate_mean", 100, "%"},
                                  {"feature_undetermined_mean", 100, "%"},
                                  {"range_error_mean", 100, "%"},
                                  {"range_error_median", 100, "%"},
                                  {"range_error_p95", 100, "%"},
                                  {"range_error_bias", 100, "%"},
                                  {"missed", 100, "%"},
                                  {"phantom", 100, "%"},
                                  {"range_undetermined", 100, "%"},
                                  {"translation_error", 100, "%"},
                                  {"rotation_error", 100, "%"},
                                  {"ms_median", 1, "ms"},
                                  {"ms_p95", 1, "ms"}};
  std::ostringstream table;
  constexpr int kNameWidth = 28;
  constexpr int kValueWidth = 15;
  const auto line = [&](const std::string& name, const auto& value_of) {
    table << std::left << std::setw(kNameWidth) << name << std::right;
    for (const GroundScores& score : scores) table << std::setw(kValueWidth) << value_of(score);
    table << '\n';
  };
  const auto number = [](double value) {
    std::ostringstream text;
    text << std::fixed << std::setprecision(2) << value;
    return text.str();
  };
  line("", [](const GroundScores& score) { return score.sequence; });
  line("frames", [](const GroundScores& score) { return score.frames; });
  for (const Row& row : kRows) {
    line(row.name + std::string(" ") + row.unit, [&](const GroundScores& score) {
      const auto found = score.values.find(row.name);
      return found == score.values.end() ? "-" : number(row.factor * found->second);
    });
  }
  if (!scores.empty()) {
    for (const auto& [stage, unused] : scores.front().stage_ms) {
      line("ms " + stage,
           [&](const GroundScores& score) { return number(score.stage_ms.at(stage)); });
    }
  }
  return table.str();
}

}  // namespace beckon
