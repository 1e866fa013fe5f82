#include "tools/site_simulation/simulated_site.hpp"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "services/rssi_localizer/calibration_set.hpp"
#include "services/rssi_localizer/path_loss.hpp"

namespace beckon {
namespace {

constexpr Utime kReadingPeriodUs = 500'000;
constexpr Utime kStayUs = 60'000'000;  // between points: each epoch stands alone
constexpr double kWalkMps = 0.5;

// What the radio makes of one place, with this seed.
class Radio {
 public:
  Radio(const Place& place, unsigned seed) : place_(place), walls_(place.site.plan), random_(seed) {
    for (std::size_t b = 0; b < place.site.beacons.size(); ++b) {
      fields_.emplace_back(place.radio.decorrelation_m, random_);
    }
  }

  // A reading of a beacon by something at a position and height; none where it is lost.
  std::optional<double> Read(std::size_t beacon, const Eigen::Vector2d& at, double height_m) {
    const RadioModel& radio = place_.radio;
    const Beacon& from = place_.site.beacons[beacon];
    const double power = radio.rssi_at_1m_dbm -
                         10.0 * radio.exponent * std::log10(BeaconDistance(from, height_m, at)) -
                         radio.wall_db * walls_.Crossed(from.position.head<2>(), at) +
                         radio.shadowing_sd_db * fields_[beacon].At(at) +
                         radio.fading_sd_db * normal_(random_);
    if (power < radio.sensitivity_dbm + radio.sensitivity_sd_db * normal_(random_)) return {};
    return radio.quantum_db * std::round(power / radio.quantum_db);
  }

 private:
  const Place& place_;
  WallCounter walls_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<ShadowingField> fields_;
};

std::ofstream Open(const std::filesystem::path& file) {
  std::ofstream stream(file);
  if (!stream) throw std::runtime_error("cannot write " + file.string());
  stream.exceptions(std::ofstream::badbit | std::ofstream::failbit);
  stream.setf(std::ios::fixed);
  stream.precision(3);
  return stream;
}

std::string Text(const Eigen::Vector2d& point) {
  char text[64];
  std::snprintf(text, sizeof text, "[%.3f, %.3f]", point.x(), point.y());
  return text;
}

void WriteSite(const Site& site, const std::filesystem::path& folder) {
  std::ofstream toml = Open(folder / "site.toml");
  toml << "# Made by simulate_site.\nname = \"" << site.name
       << "\"\n\n[area]\nmin = " << Text(site.plan.min) << "\nmax = " << Text(site.plan.max)
       << '\n';
  if (!site.plan.outline.empty()) {
    toml << "outline = [";
    for (const Eigen::Vector2d& corner : site.plan.outline) toml << Text(corner) << ", ";
    toml << "]\n";
  }
  toml << "\n[tag]\nheight_m = " << site.tag_height_m
       << "\n\n[evaluation]\nwindow_s = " << site.window_s << '\n';
  for (const Wall& wall : site.plan.walls) {
    toml << "\n[[walls]]\nfrom = " << Text(wall.from) << "\nto = " << Text(wall.to) << '\n';
  }
  for (const Beacon& beacon : site.beacons) {
    toml << "\n[[beacons]]\nid = \"" << beacon.id << "\"\nposition = [" << beacon.position.x()
         << ", " << beacon.position.y() << ", " << beacon.position.z() << "]\n";
  }
}

void WriteRadio(const RadioModel& radio, const std::filesystem::path& folder) {
  Open(folder / "generated.toml") << "# What generated the readings.\n[radio]\nrssi_at_1m_dbm = "
                                  << radio.rssi_at_1m_dbm << "\nexponent = " << radio.exponent
                                  << "\nwall_db = " << radio.wall_db
                                  << "\nshadowing_sd_db = " << radio.shadowing_sd_db
                                  << "\ndecorrelation_m = " << radio.decorrelation_m
                                  << "\nfading_sd_db = " << radio.fading_sd_db
                                  << "\nquantum_db = " << radio.quantum_db << '\n';
}

}  // namespace

ShadowingField::ShadowingField(double length_m, std::mt19937_64& random) {
  constexpr int kWaves = 400;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  for (int i = 0; i < kWaves; ++i) {
    // The spectrum of exp(-r / length) in the plane is that of a t distribution with one degree of
    // freedom: a normal vector divided by an independent normal number.
    const Eigen::Vector2d direction(normal(random), normal(random));
    const double divisor = std::max(1e-9, std::abs(normal(random))) * length_m;
    waves_.push_back({direction / divisor, phase(random)});
  }
}

double ShadowingField::At(const Eigen::Vector2d& position) const {
  double sum = 0.0;
  for (const Wave& wave : waves_) sum += std::cos(wave.number.dot(position) + wave.phase);
  return std::sqrt(2.0 / static_cast<double>(waves_.size())) * sum;
}

void WriteSimulatedSite(const Place& place, unsigned seed, const std::filesystem::path& folder) {
  const Site& site = place.site;
  std::filesystem::create_directories(folder);
  WriteSite(site, folder);
  WriteRadio(place.radio, folder);
  Radio radio(place, seed);
  Utime utime = 1'000'000'000;

  std::ofstream calibration = Open(folder / "calibration.csv");
  calibration << "utime,tag,beacon,rssi_dbm,x_m,y_m\n";
  const auto calibrate = [&](const std::string& tag, const Eigen::Vector2d& at, double height_m) {
    for (std::size_t b = 0; b < site.beacons.size(); ++b) {
      if (site.beacons[b].id == tag) continue;
      if (const auto rssi = radio.Read(b, at, height_m)) {
        calibration << utime << ',' << tag << ',' << site.beacons[b].id << ',' << *rssi << ','
                    << at.x() << ',' << at.y() << '\n';
      }
    }
    utime += kReadingPeriodUs;
  };
  for (std::size_t leg = 1; leg < place.walk.size(); ++leg) {
    const Eigen::Vector2d way = place.walk[leg] - place.walk[leg - 1];
    const int steps =
        std::max(1, static_cast<int>(way.norm() / (kWalkMps * SecondsFromUtime(kReadingPeriodUs))));
    for (int step = 0; step < steps; ++step) {
      calibrate("walk", place.walk[leg - 1] + way * step / steps, site.tag_height_m);
    }
  }
  for (const Beacon& beacon : site.beacons) {
    for (int i = 0; i < 4; ++i) {
      calibrate(beacon.id, beacon.position.head<2>(), beacon.position.z());
    }
    utime += kStayUs;
  }

  std::ofstream readings = Open(folder / "readings.csv");
  readings << "utime,tag,beacon,rssi_dbm\n";
  std::ofstream truth = Open(folder / "truth.csv");
  truth << "utime,tag,x_m,y_m\n";
  for (const Eigen::Vector2d& point : place.points) {
    const Utime end = utime + UtimeFromSeconds(site.window_s);
    for (; utime < end; utime += kReadingPeriodUs) {
      for (std::size_t b = 0; b < site.beacons.size(); ++b) {
        if (const auto rssi = radio.Read(b, point, site.tag_height_m)) {
          readings << utime << ",tag," << site.beacons[b].id << ',' << *rssi << '\n';
        }
      }
    }
    truth << end - 1 << ",tag," << point.x() << ',' << point.y() << '\n';
    utime = end + kStayUs;
  }
}

}  // namespace beckon
