#include "tools/evaluation/ground/sequence.hpp"

#include <algorithm>

#include "common/config.hpp"
#include "common/csv.hpp"

namespace beckon {
namespace {

// Frames by the number in their name.
std::map<std::int64_t, std::filesystem::path> NumberedFiles(const std::filesystem::path& folder,
                                                            const std::string& extension) {
  std::map<std::int64_t, std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string stem = entry.path().stem().string();
    const bool number = !stem.empty() && stem.size() < 12 &&
                        stem.find_first_not_of("0123456789") == std::string::npos;
    if (number && entry.path().extension() == extension) files[std::stoll(stem)] = entry.path();
  }
  return files;
}

}  // namespace

Sequence LoadSequence(const std::filesystem::path& folder) {
  Sequence sequence;
  ConfigFile file(folder / "sequence.toml");
  file.root().Required("name", sequence.name);
  file.root().Required("rate_hz", sequence.rate_hz, Range{0.01, 1000.0});
  sequence.camera = GroundCamera::FromConfig(file.root());
  file.Finish();

  const auto pictures = NumberedFiles(folder / "frames", ".jpg");
  if (pictures.empty()) throw FileError(folder / "frames", "holds no NNNNNN.jpg");
  const auto truths = NumberedFiles(folder / "truth", ".png");
  std::map<std::int64_t, std::size_t> index;
  for (const auto& [number, path] : pictures) {
    SequenceFrame frame;
    frame.picture = path;
    frame.utime = UtimeFromSeconds(static_cast<double>(number) / sequence.rate_hz);
    if (const auto truth = truths.find(number); truth != truths.end()) frame.truth = truth->second;
    index[number] = sequence.frames.size();
    sequence.frames.push_back(std::move(frame));
  }

  const auto frame_of = [&](CsvReader& reader) -> SequenceFrame& {
    const auto found = index.find(reader.Integer(0));
    if (found == index.end()) reader.Fail("there is no frame " + reader.Text(0));
    return sequence.frames[found->second];
  };
  if (std::filesystem::exists(folder / "scans.csv")) {
    CsvReader reader(folder / "scans.csv", {"frame", "bearing_rad", "range_m"});
    while (reader.Next()) {
      frame_of(reader).ranges.push_back({reader.Number(1), reader.Number(2, true)});
    }
  }
  if (std::filesystem::exists(folder / "poses.csv")) {
    CsvReader reader(folder / "poses.csv", {"frame", "utime", "x_m", "y_m", "theta_rad"});
    while (reader.Next()) {
      SequenceFrame& frame = frame_of(reader);
      frame.utime = reader.Integer(1);
      frame.map_from_robot = Pose2{reader.Number(2), reader.Number(3), reader.Number(4)};
    }
  }
  for (std::size_t i = 1; i < sequence.frames.size(); ++i) {
    if (sequence.frames[i].utime <= sequence.frames[i - 1].utime) {
      throw FileError(folder / "poses.csv", "utime does not increase from frame to frame");
    }
  }
  return sequence;
}

}  // namespace beckon
