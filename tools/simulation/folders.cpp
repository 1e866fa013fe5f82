#include "tools/simulation/folders.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "common/jpeg.hpp"
#include "tools/simulation/scripted_drive.hpp"

namespace beckon::simulation {
namespace {

// A text file that has to come into being.
class Output {
 public:
  explicit Output(const std::filesystem::path& path) : path_(path), stream_(path) {
    if (!stream_) throw std::runtime_error("cannot write " + path.string());
  }
  ~Output() noexcept(false) {
    stream_.close();
    if (!stream_ && std::uncaught_exceptions() == 0)
      throw std::runtime_error("cannot write " + path_.string());
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  void Write(const std::string& text) { stream_ << text; }
  __attribute__((format(printf, 2, 3))) void Print(const char* format, ...) {
    char line[512];
    std::va_list arguments;
    va_start(arguments, format);
    const int length = std::vsnprintf(line, sizeof(line), format, arguments);
    va_end(arguments);
    stream_.write(line, std::min<std::streamsize>(length, sizeof(line) - 1));
  }

 private:
  std::filesystem::path path_;
  std::ofstream stream_;
};

void PrintPolygon(const Polygon& polygon, Output& out) {
  out.Print("[");
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    out.Print("%s[%.3f, %.3f]", i == 0 ? "" : ", ", polygon[i].x(), polygon[i].y());
  }
  out.Print("]");
}

void WriteSiteToml(const std::filesystem::path& file, const Site& site) {
  Output out(file);
  out.Print(
      "# Simulated flat; the furniture is left out, for the camera to find.\nname = \"%s\"\n\n",
      site.name.c_str());
  out.Print("[area]\nmin = [%.3f, %.3f]\nmax = [%.3f, %.3f]\noutline = ", site.plan.min.x(),
            site.plan.min.y(), site.plan.max.x(), site.plan.max.y());
  PrintPolygon(site.plan.outline, out);
  out.Print("\n# inner walls have a thickness\nobstacles = [");
  for (std::size_t i = 0; i < site.plan.obstacles.size(); ++i) {
    out.Print(i == 0 ? "\n  " : ",\n  ");
    PrintPolygon(site.plan.obstacles[i], out);
  }
  out.Print("]\n\n[tag]\nheight_m = %.2f\n\n[evaluation]\nwindow_s = %.2f\n", site.tag_height_m,
            site.window_s);
  for (const Wall& wall : site.plan.walls) {
    out.Print("\n[[walls]]\nfrom = [%.3f, %.3f]\nto = [%.3f, %.3f]\n", wall.from.x(), wall.from.y(),
              wall.to.x(), wall.to.y());
  }
  for (const Beacon& beacon : site.beacons) {
    out.Print("\n[[beacons]]\nid = \"%s\"\nposition = [%.3f, %.3f, %.3f]\n", beacon.id.c_str(),
              beacon.position.x(), beacon.position.y(), beacon.position.z());
  }
}

constexpr long long kFirstUtime = 1'700'000'000'000'000;

// A person with a tag goes to every free place on a raster and stands there for a few packets.
void WriteCalibration(const std::filesystem::path& file, const World& world, const Radio& radio) {
  constexpr double kRasterM = 0.7;
  constexpr int kPackets = 6;
  Output out(file);
  out.Print("utime,tag,beacon,rssi_dbm,x_m,y_m\n");
  const ClearanceMap map = MakeClearanceMap(world);
  long long utime = kFirstUtime;
  std::uint64_t draws = 0;
  const GridGeometry raster = GridGeometry::Covering(world.min, world.max, kRasterM);
  for (int i = 0; i < raster.size(); ++i) {
    const Eigen::Vector2d place = raster.Centre(i);
    if (map.At(place) < kPersonRadiusM) continue;
    for (int packet = 0; packet < kPackets; ++packet) {
      utime += 250'000;
      for (std::size_t k = 0; k < world.beacons.size(); ++k) {
        Random random(world.seed, Stream::kCalibrationWalk, draws++);
        if (const auto rssi = radio.Transmit(k, place, kTagHeightM, random)) {
          out.Print("%lld,calibration,%s,%d,%.3f,%.3f\n", utime, world.beacons[k].id.c_str(), *rssi,
                    place.x(), place.y());
        }
      }
    }
  }
}

// Other places than those of the calibration, one epoch each.
void WriteReadings(const std::filesystem::path& folder, const World& world, const Radio& radio,
                   double window_s) {
  constexpr int kPlaces = 60;
  constexpr int kPackets = 8;
  Output readings(folder / "readings.csv");
  Output truth(folder / "truth.csv");
  readings.Print("utime,tag,beacon,rssi_dbm\n");
  truth.Print("utime,tag,x_m,y_m\n");
  const ClearanceMap map = MakeClearanceMap(world);
  const auto step_us = static_cast<long long>(1e6 * window_s / kPackets);
  long long utime = kFirstUtime + 3'600'000'000;
  std::uint64_t draws = 1U << 24U;
  Random place(world.seed, Stream::kCalibrationWalk, draws++);
  for (int done = 0; done < kPlaces;) {
    const Eigen::Vector2d point = place.UniformIn(world.min, world.max);
    if (map.At(point) < kPersonRadiusM) continue;
    ++done;
    for (int packet = 0; packet < kPackets; ++packet) {
      utime += step_us;
      for (std::size_t i = 0; i < world.beacons.size(); ++i) {
        Random random(world.seed, Stream::kCalibrationWalk, draws++);
        if (const auto rssi = radio.Transmit(i, point, kTagHeightM, random)) {
          readings.Print("%lld,%s,%s,%d\n", utime, kCallerTag, world.beacons[i].id.c_str(), *rssi);
        }
      }
    }
    truth.Print("%lld,%s,%.3f,%.3f\n", utime, kCallerTag, point.x(), point.y());
  }
}

void WriteBytes(const std::filesystem::path& file, const std::vector<std::uint8_t>& bytes) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  if (!stream) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace

GroundCamera DefaultCamera() {
  constexpr double kWidthDeg = 68.0;
  constexpr int kWidth = 640;
  const double focal_px = 0.5 * kWidth / std::tan(0.5 * RadiansFromDegrees(kWidthDeg));
  return GroundCamera::Pinhole(kWidth, 480, focal_px, 0.55, RadiansFromDegrees(26.0));
}

void WriteSite(const std::filesystem::path& folder, const World& world,
               const RadioOptions& options) {
  std::filesystem::create_directories(folder);
  const Site site = SiteOf(world);
  const Radio radio(world, options);
  WriteSiteToml(folder / "site.toml", site);
  WriteCalibration(folder / "calibration.csv", world, radio);
  WriteReadings(folder, world, radio, site.window_s);
}

void WriteCamera(const std::filesystem::path& file, const std::string& name, double rate_hz,
                 const GroundCamera& camera) {
  Output out(file);
  out.Print("# Simulated camera.\nname = \"%s\"\nrate_hz = %.3f\n", name.c_str(), rate_hz);
  out.Write(camera.Toml());
}

void WriteSequence(const std::filesystem::path& folder, const World& world,
                   const GroundCamera& camera, const SequenceOptions& options) {
  for (const char* name : {"frames", "truth"}) {
    std::filesystem::create_directories(folder / name);
    // Frames of an earlier, longer drive would be taken for this one's.
    if (!std::filesystem::is_empty(folder / name)) {
      throw std::runtime_error((folder / name).string() + " is not empty");
    }
  }
  WriteCamera(folder / "sequence.toml", "simulated_" + std::to_string(world.seed), options.rate_hz,
              camera);
  Output scans(folder / "scans.csv");
  Output poses(folder / "poses.csv");
  scans.Print("frame,bearing_rad,range_m\n");
  poses.Print("frame,utime,x_m,y_m,theta_rad\n");

  BaseOptions base;
  base.robot.max_speed_mps = options.speed_mps;
  Simulation simulation(world, base, RadioOptions{});
  ScriptedDrive drive(world);
  Renderer renderer(world, camera, options.render);
  const double half_view = std::atan(0.5 * camera.width / camera.fx);
  constexpr int kRays = 121;
  for (int frame = 0; frame < options.frames; ++frame) {
    const double time_s = frame / options.rate_hz;
    while (simulation.truth().time_s + 0.5 * kStepS < time_s) {
      const auto [linear, angular] = drive.Command(simulation);
      simulation.Command(linear, angular);
      simulation.Step();
    }
    char name[16];
    std::snprintf(name, sizeof(name), "%06d", frame);
    const Pose2& pose = simulation.truth().map_from_robot;
    cv::Mat labels;
    const cv::Mat image =
        renderer.Render(pose, simulation.People(), static_cast<std::uint64_t>(frame), &labels);
    WriteBytes(folder / "frames" / (std::string(name) + ".jpg"),
               EncodeJpeg(image, options.jpeg_quality));
    const std::string truth_file = (folder / "truth" / (std::string(name) + ".png")).string();
    if (!cv::imwrite(truth_file, labels)) throw std::runtime_error("cannot write " + truth_file);
    poses.Print("%d,%lld,%.6f,%.6f,%.6f\n", frame,
                static_cast<long long>(UtimeFromSeconds(simulation.truth().time_s)), pose.x, pose.y,
                pose.theta);
    for (int ray = 0; ray < kRays; ++ray) {
      const double bearing = half_view * (1.0 - 2.0 * ray / (kRays - 1.0));
      const double range = simulation.Range(bearing);
      scans.Print("%d,%.6f,", frame, bearing);
      if (range > options.max_range_m) {
        scans.Print("inf\n");
      } else {
        scans.Print("%.4f\n", range);
      }
    }
  }
}

}  // namespace beckon::simulation
