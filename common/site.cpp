#include "common/site.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "common/config.hpp"
#include "common/csv.hpp"
#include "common/log.hpp"

namespace beckon {
namespace {

void CheckPolygon(ConfigTable& table, const std::string& key, const Polygon& polygon) {
  if (polygon.size() < 3) table.Fail(key, "a polygon needs three points");
}

MapImage LoadMapImage(ConfigTable& root) {
  std::filesystem::path file;
  root.RequiredPath("map_image", file);
  MapImage map;
  root.Required("map_resolution_m", map.grid.resolution_m, Range{0.001, 100.0});
  root.Required("map_origin", map.grid.origin);
  const cv::Mat picture = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  if (picture.empty())
    root.Fail("map_image", "'" + file.string() + "' is not a picture that can be read");
  cv::flip(picture >= 128, map.free, 0);
  map.grid.width = map.free.cols;
  map.grid.height = map.free.rows;
  return map;
}

FloorPlan ReadFloorPlan(ConfigTable& root) {
  FloorPlan plan;
  ConfigTable& area = root.Table("area");
  area.Required("min", plan.min);
  area.Required("max", plan.max);
  if (!(plan.min.array() < plan.max.array()).all())
    area.Fail("max", "has to be larger than min in x and y");
  // The outline is written in [area]; at the top it is accepted too, where its siblings stand.
  for (ConfigTable* table : {&area, &root}) {
    if (table->Has("outline")) {
      plan.outline = table->Points("outline");
      CheckPolygon(*table, "outline", plan.outline);
    }
    for (Polygon& obstacle : table->PointLists("obstacles")) {
      CheckPolygon(*table, "obstacles", obstacle);
      plan.obstacles.push_back(std::move(obstacle));
    }
    if (table->Has("map_image")) plan.image = LoadMapImage(*table);
    for (ConfigTable* wall_table : table->Tables("walls")) {
      Wall wall;
      wall_table->Required("from", wall.from);
      wall_table->Required("to", wall.to);
      if (wall_table->Has("attenuation_db")) {
        double attenuation_db = 0.0;
        wall_table->Required("attenuation_db", attenuation_db, Range{0.0, 100.0});
        wall.attenuation_db = attenuation_db;
      }
      plan.walls.push_back(wall);
    }
  }
  return plan;
}

// Reads the columns utime,tag,beacon,rssi_dbm of the present row.
Reading ReadReading(const CsvReader& csv, const Site& site) {
  Reading reading{csv.Integer(0), csv.Text(1), csv.Text(2), csv.Number(3)};
  if (site.BeaconIndex(reading.beacon) < 0) {
    csv.Fail("beacon '" + reading.beacon + "' is not declared in the site file");
  }
  return reading;
}

const std::vector<std::string> kCalibrationColumns = {"utime",    "tag", "beacon",
                                                      "rssi_dbm", "x_m", "y_m"};

CalibrationReading ReadCalibration(const CsvReader& csv, const Site& site) {
  return {ReadReading(csv, site), {csv.Number(4), csv.Number(5)}};
}

// Real receivers now and then report a power that cannot be. Such a row is no reason to refuse a
// recording of an hour, but it is told.
class ImpossiblePowers {
 public:
  explicit ImpossiblePowers(std::filesystem::path file) : file_(std::move(file)) {}
  ~ImpossiblePowers() {
    if (count_ == 0) return;
    LogWarning(file_.string() + ":" + std::to_string(first_line_) +
               ": rssi_dbm is outside -130 to 20; " + std::to_string(count_) +
               " such rows passed over");
  }
  ImpossiblePowers(const ImpossiblePowers&) = delete;
  ImpossiblePowers& operator=(const ImpossiblePowers&) = delete;

  bool Holds(double rssi_dbm, int line) {
    if (IsPlausibleRssi(rssi_dbm)) return false;
    if (count_++ == 0) first_line_ = line;
    return true;
  }

 private:
  std::filesystem::path file_;
  int count_ = 0;
  int first_line_ = 0;
};

}  // namespace

Site Site::Load(const std::filesystem::path& folder) {
  ConfigFile file(folder / "site.toml");
  ConfigTable& root = file.root();
  Site site;
  root.Required("name", site.name);
  site.plan = ReadFloorPlan(root);
  root.Table("tag").Optional("height_m", site.tag_height_m, Range{0.0, 100.0});
  root.Table("evaluation").Optional("window_s", site.window_s, Range{0.001, 3600.0});
  std::set<std::string> ids;
  for (ConfigTable* table : root.Tables("beacons")) {
    Beacon beacon;
    table->Required("id", beacon.id);
    table->Required("position", beacon.position);
    if (!ids.insert(beacon.id).second)
      table->Fail("id", "beacon '" + beacon.id + "' is declared twice");
    site.beacons.push_back(std::move(beacon));
  }
  if (site.beacons.empty()) root.Fail("beacons", "a site needs at least one [[beacons]]");
  try {
    file.Finish();
  } catch (const ConfigError& error) {
    // Recorded data may come from somebody else's tools: what we do not know is no reason to refuse
    // it.
    LogWarning(error.what());
  }
  return site;
}

int Site::BeaconIndex(const std::string& id) const {
  const auto found =
      std::find_if(beacons.begin(), beacons.end(), [&](const Beacon& b) { return b.id == id; });
  return found != beacons.end() ? static_cast<int>(found - beacons.begin()) : -1;
}

std::vector<Reading> LoadReadings(const std::filesystem::path& file, const Site& site) {
  CsvReader csv(file, {"utime", "tag", "beacon", "rssi_dbm"});
  std::vector<Reading> readings;
  ImpossiblePowers impossible(file);
  while (csv.Next()) {
    Reading reading = ReadReading(csv, site);
    if (!impossible.Holds(reading.rssi_dbm, csv.line())) readings.push_back(std::move(reading));
  }
  return readings;
}

std::vector<CalibrationReading> LoadCalibration(const std::filesystem::path& file,
                                                const Site& site) {
  CsvReader csv(file, kCalibrationColumns);
  std::vector<CalibrationReading> readings;
  ImpossiblePowers impossible(file);
  while (csv.Next()) {
    CalibrationReading reading = ReadCalibration(csv, site);
    if (!impossible.Holds(reading.reading.rssi_dbm, csv.line()))
      readings.push_back(std::move(reading));
  }
  return readings;
}

std::vector<CalibrationReading> LoadRobotCalibration(const std::filesystem::path& file,
                                                     const Site& site) {
  CsvReader csv(file, kCalibrationColumns);
  std::vector<CalibrationReading> readings;
  int broken = 0;
  std::string first;
  while (true) {
    try {
      if (!csv.Next()) break;
      CalibrationReading reading = ReadCalibration(csv, site);
      reading.by_robot = true;
      if (IsPlausibleRssi(reading.reading.rssi_dbm)) readings.push_back(std::move(reading));
    } catch (const FileError& error) {
      if (++broken == 1) first = error.what();
    }
  }
  if (broken > 0) LogWarning(first + "; " + std::to_string(broken) + " such rows passed over");
  return readings;
}

std::vector<TruthEpoch> LoadTruth(const std::filesystem::path& file) {
  CsvReader csv(file, {"utime", "tag", "x_m", "y_m"});
  std::vector<TruthEpoch> epochs;
  while (csv.Next())
    epochs.push_back({csv.Integer(0), csv.Text(1), {csv.Number(2), csv.Number(3)}});
  return epochs;
}

}  // namespace beckon
