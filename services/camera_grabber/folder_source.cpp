#include "services/camera_grabber/folder_source.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "common/config.hpp"
#include "services/camera_grabber/pacer.hpp"

namespace beckon {
namespace {

constexpr double kUsualRateHz = 10.0;
constexpr std::uintmax_t kMaxFileBytes = 64U << 20U;

bool IsPicture(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

std::vector<std::filesystem::path> PicturesIn(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (IsPicture(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

double RateOf(const std::filesystem::path& sequence_toml) {
  double rate_hz = kUsualRateHz;
  try {
    ConfigFile(sequence_toml).root().Optional("rate_hz", rate_hz, Range{0.01, 1000.0});
  } catch (const ConfigError& error) {
    throw SourceError(error.what());
  }
  return rate_hz;
}

class FolderSource : public FrameSource {
 public:
  FolderSource(const PlaybackOptions& options, int jpeg_quality, double rate_hz,
               std::vector<std::filesystem::path> files, const Clock& clock)
      : loop_(options.loop),
        jpeg_quality_(jpeg_quality),
        files_(std::move(files)),
        clock_(clock),
        pacer_(rate_hz, options.start_delay_s, clock) {}

  std::optional<Frame> Next(std::chrono::milliseconds timeout) override {
    if (ended() || !pacer_.Wait(timeout)) return std::nullopt;
    const std::filesystem::path file = files_[next_++];
    if (loop_ && next_ == files_.size()) next_ = 0;
    if (file.extension() == ".png") return ReadPng(file);
    return FrameFromJpeg(clock_.Now().utime, ReadBytes(file), file.string());
  }

  bool ended() const override { return next_ >= files_.size(); }
  bool is_live() const override { return false; }
  bool may_repeat() const override { return true; }

 private:
  Frame ReadPng(const std::filesystem::path& file) const {
    cv::Mat image;
    try {
      image = cv::imread(file.string(), cv::IMREAD_COLOR);
    } catch (const cv::Exception&) {  // larger than OpenCV reads
    }
    if (image.empty()) throw FrameError(file.string() + " is not a picture that can be read");
    return FrameFromImage(clock_.Now().utime, image, jpeg_quality_, file.string());
  }

  static std::vector<std::uint8_t> ReadBytes(const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::file_size(file, error) > kMaxFileBytes || error) {
      throw FrameError(file.string() + " cannot be read, or is larger than a frame can be");
    }
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  const bool loop_;
  const int jpeg_quality_;
  const std::vector<std::filesystem::path> files_;
  const Clock& clock_;
  Pacer pacer_;
  std::size_t next_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> OpenFolderSource(const PlaybackOptions& options, int jpeg_quality,
                                              const Clock& clock) {
  const std::filesystem::path sequence_toml = options.path / "sequence.toml";
  const bool is_sequence = std::filesystem::is_regular_file(sequence_toml);
  const std::filesystem::path folder = is_sequence ? options.path / "frames" : options.path;
  std::vector<std::filesystem::path> files = PicturesIn(folder);
  if (files.empty()) throw SourceError(folder.string() + " holds no .jpg, .jpeg or .png files");
  const double rate_hz = options.rate_hz > 0.0 ? options.rate_hz
                         : is_sequence         ? RateOf(sequence_toml)
                                               : kUsualRateHz;
  return std::make_unique<FolderSource>(options, jpeg_quality, rate_hz, std::move(files), clock);
}

}  // namespace beckon
