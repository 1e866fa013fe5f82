#include "services/rssi_localizer/measurement_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace beckon {
namespace {

// A reading that no model explains, spread evenly over 100 dB.
constexpr double kWildDensity = 0.01 / 100.0;

double Gaussian(double x, double variance) {
  return std::exp(-0.5 * x * x / variance) / std::sqrt(2.0 * std::numbers::pi * variance);
}

// Residual distributions are kept for a few spreads of the residual map, as it knows some places
// well and others not at all.
constexpr std::array<double, 8> kMapSd = {0.0, 1.5, 3.0, 4.5, 6.0, 8.0, 10.0, 12.0};

int MapSdLevel(double variance_db2) {
  const double sd = std::sqrt(variance_db2);
  int nearest = 0;
  for (std::size_t level = 1; level < kMapSd.size(); ++level) {
    if (std::abs(kMapSd[level] - sd) < std::abs(kMapSd[static_cast<std::size_t>(nearest)] - sd)) {
      nearest = static_cast<int>(level);
    }
  }
  return nearest;
}

struct HistogramShape {
  double column_m = 0.5;
  int columns = 0;
  double min_db = -60.0;
  double step_db = 0.5;
  int bins = 240;

  int Column(double distance_m) const {
    return std::clamp(static_cast<int>(distance_m / column_m), 0, columns - 1);
  }
  int Bin(double db) const {
    return std::clamp(static_cast<int>((db - min_db) / step_db), 0, bins - 1);
  }
  double Centre(int bin) const { return min_db + (bin + 0.5) * step_db; }
};

double FurthestCell(const FloorGrid& grid, const Site& site) {
  double furthest = 1.0;
  for (const Beacon& beacon : site.beacons) {
    for (const Eigen::Vector2d& centre : grid.centres()) {
      furthest = std::max(furthest, BeaconDistance(beacon, site.tag_height_m, centre));
    }
  }
  return furthest;
}

// A table of columns x bins, smoothed along one axis by a Gaussian of the given sd in cells.
void SmoothColumns(std::vector<double>& table, int columns, int bins, double sd) {
  const int reach = static_cast<int>(std::ceil(3.0 * sd));
  std::vector<double> smoothed(table.size(), 0.0);
  for (int from = 0; from < columns; ++from) {
    for (int to = std::max(0, from - reach); to <= std::min(columns - 1, from + reach); ++to) {
      // Not normalised: a column's weight is the number of readings near it.
      const double weight = std::exp(-0.5 * (to - from) * (to - from) / (sd * sd));
      for (int bin = 0; bin < bins; ++bin) {
        smoothed[static_cast<std::size_t>(to * bins + bin)] +=
            weight * table[static_cast<std::size_t>(from * bins + bin)];
      }
    }
  }
  table = std::move(smoothed);
}

std::vector<double> SmoothBins(const std::vector<double>& table, int columns, int bins, double sd) {
  const int reach = static_cast<int>(std::ceil(3.5 * sd));
  std::vector<double> kernel;
  for (int k = -reach; k <= reach; ++k) kernel.push_back(Gaussian(k, sd * sd));
  std::vector<double> smoothed(table.size(), 0.0);
  for (int column = 0; column < columns; ++column) {
    for (int from = 0; from < bins; ++from) {
      const double value = table[static_cast<std::size_t>(column * bins + from)];
      if (value == 0.0) continue;
      for (int k = -reach; k <= reach; ++k) {
        const int to = std::clamp(from + k, 0, bins - 1);
        smoothed[static_cast<std::size_t>(column * bins + to)] +=
            value * kernel[static_cast<std::size_t>(k + reach)];
      }
    }
  }
  return smoothed;
}

struct SampleResidual {
  double distance_m;
  double residual_db;
  double weight;
};

// Three readings in ten pass a body, which takes off a loss that is distributed exponentially, 8 dB
// on average (at 2.4 GHz, a person takes 5 to 20 dB). Weak readings become less telling than strong
// ones: a body weakens a signal, and nothing strengthens it.
void MixInBodies(double step_db, std::vector<double>& density) {
  constexpr double kShare = 0.3;
  constexpr double kMeanLossDb = 8.0;
  const double keep = std::exp(-step_db / kMeanLossDb);
  double weakened = 0.0;
  for (std::size_t bin = density.size(); bin-- > 0;) {
    weakened = keep * weakened + (1.0 - keep) * density[bin];
    density[bin] = (1.0 - kShare) * density[bin] + kShare * weakened;
  }
}

// Density of a residual where the fit leaves sd_db and the residual map another map_variance: one
// reading in twenty has three times the spread.
double LogNormalDensity(double off_db, double sd_db, double map_variance) {
  return 0.95 * Gaussian(off_db, sd_db * sd_db + map_variance) +
         0.05 * Gaussian(off_db, 9.0 * sd_db * sd_db + map_variance);
}

// One row for each (distance column, spread of the residual map).
MeasurementModel::Rows ResidualRows(const HistogramShape& shape, double sd_db, bool bodies,
                                    const std::vector<SampleResidual>& samples) {
  // As many readings near a distance as it takes for them to count as much as the log-normal model.
  constexpr double kFallbackReadings = 20.0;
  constexpr double kColumnSmoothingM = 1.0;
  constexpr double kBinSmoothingDb = 2.0;
  const auto size = static_cast<std::size_t>(shape.columns * shape.bins);
  std::vector<double> histogram(size, 0.0);
  for (const SampleResidual& sample : samples) {
    histogram[static_cast<std::size_t>(shape.Column(sample.distance_m) * shape.bins +
                                       shape.Bin(sample.residual_db))] += sample.weight;
  }
  if (!samples.empty()) {
    SmoothColumns(histogram, shape.columns, shape.bins, kColumnSmoothingM / shape.column_m);
  }

  MeasurementModel::Rows rows{shape.min_db, shape.step_db, shape.bins, {}};
  rows.log_density.resize(size * kMapSd.size());
  for (std::size_t level = 0; level < kMapSd.size(); ++level) {
    const double map_variance = kMapSd[level] * kMapSd[level];
    const std::vector<double> smoothed =
        SmoothBins(histogram, shape.columns, shape.bins,
                   std::sqrt(kBinSmoothingDb * kBinSmoothingDb + map_variance) / shape.step_db);
    for (int column = 0; column < shape.columns; ++column) {
      const auto first = static_cast<std::size_t>(column * shape.bins);
      double readings = 0.0;
      for (int bin = 0; bin < shape.bins; ++bin) {
        readings += smoothed[first + static_cast<std::size_t>(bin)];
      }
      std::vector<double> densities(static_cast<std::size_t>(shape.bins));
      for (int bin = 0; bin < shape.bins; ++bin) {
        const double off = shape.Centre(bin);
        const double log_normal = LogNormalDensity(off, sd_db, map_variance);
        const double measured = smoothed[first + static_cast<std::size_t>(bin)] / shape.step_db;
        densities[static_cast<std::size_t>(bin)] =
            (measured + kFallbackReadings * log_normal) / (readings + kFallbackReadings);
      }
      if (bodies) MixInBodies(shape.step_db, densities);
      for (std::size_t bin = 0; bin < densities.size(); ++bin) {
        rows.log_density[level * size + first + bin] =
            static_cast<float>(std::log(0.99 * densities[bin] + kWildDensity));
      }
    }
  }
  return rows;
}

// The likeliest sd in dB of what a residual map leaves, when it says of each residual by itself how
// unsure it is there. The prior counts as much as two readings.
double FitSpread(const std::vector<SampleResidual>& samples,
                 const std::vector<double>& map_variance, double prior_sd_db) {
  constexpr double kPriorWeight = 2.0;
  double best_score = -std::numeric_limits<double>::infinity();
  double best = prior_sd_db;
  for (double sd_db = 1.0; sd_db <= 15.0; sd_db *= 1.1) {
    double score =
        -kPriorWeight * (std::log(sd_db) + 0.5 * prior_sd_db * prior_sd_db / (sd_db * sd_db));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      score +=
          samples[i].weight *
          std::log(LogNormalDensity(samples[i].residual_db, sd_db, map_variance[i]) + kWildDensity);
    }
    if (score > best_score) {
      best_score = score;
      best = sd_db;
    }
  }
  return best;
}

}  // namespace

MeasurementModel::Cell MeasurementModel::Cell::Of(double expected_dbm, int row) {
  constexpr double kGreatest = std::numeric_limits<std::int16_t>::max();
  const double expected =
      std::clamp(expected_dbm / static_cast<double>(kStep), -kGreatest, kGreatest);
  return {static_cast<std::int16_t>(std::lround(expected)), static_cast<std::uint16_t>(row)};
}

template <typename CellAt>
void MeasurementModel::AddAt(int beacon, double rssi_dbm, double weight, const CellAt& cell_at,
                             CellValues& sum) const {
  const BeaconTable& table = beacons_[static_cast<std::size_t>(beacon)];
  const auto scale = static_cast<float>(1.0 / rows_.step_db);
  const auto rssi = static_cast<float>(rssi_dbm - rows_.min_db);
  const auto factor = static_cast<float>(weight);
  const int last = rows_.bins - 1;
  constexpr std::size_t kAhead = 64;  // the tables of a big building do not fit in the cache
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const std::size_t cell = cell_at(i);
    if (i + kAhead < sum.size()) __builtin_prefetch(&table[cell_at(i + kAhead)]);
    const int bin = static_cast<int>((rssi - table[cell].expected_dbm()) * scale);
    sum[i] += factor * rows_.log_density[static_cast<std::size_t>(table[cell].row * rows_.bins +
                                                                  std::clamp(bin, 0, last))];
  }
}

void MeasurementModel::AddLogLikelihood(int beacon, double rssi_dbm, double weight,
                                        CellValues& sum) const {
  AddAt(
      beacon, rssi_dbm, weight, [](std::size_t i) { return i; }, sum);
}

void MeasurementModel::AddLogLikelihood(int beacon, double rssi_dbm, double weight,
                                        std::span<const int> cells, CellValues& sum) const {
  AddAt(
      beacon, rssi_dbm, weight, [&](std::size_t i) { return static_cast<std::size_t>(cells[i]); },
      sum);
}

MeasurementModel MeasurementModel::Restricted(std::span<const int> cells) const {
  std::vector<BeaconTable> tables;
  for (const BeaconTable& whole : beacons_) {
    BeaconTable& table = tables.emplace_back();
    for (const int cell : cells) {
      table.push_back(whole[static_cast<std::size_t>(cell)]);
    }
  }
  return {rows_, std::move(tables)};
}

double MeasurementModel::LogLikelihoodAt(int beacon, double rssi_dbm, int cell) const {
  const BeaconTable& table = beacons_[static_cast<std::size_t>(beacon)];
  const auto at = static_cast<std::size_t>(cell);
  const double off = rssi_dbm - static_cast<double>(table[at].expected_dbm()) - rows_.min_db;
  const int bin = std::clamp(static_cast<int>(off / rows_.step_db), 0, rows_.bins - 1);
  return static_cast<double>(
      rows_.log_density[static_cast<std::size_t>(table[at].row * rows_.bins + bin)]);
}

double LeastUsedRssi(const Heard& heard, const Trust& trust) {
  const auto most = static_cast<std::size_t>(trust.strongest);
  if (heard.size() <= most) return -std::numeric_limits<double>::infinity();
  std::vector<double> rssi;
  for (const auto& [beacon, value] : heard) rssi.push_back(value);
  std::nth_element(rssi.begin(), rssi.begin() + (trust.strongest - 1), rssi.end(),
                   std::greater<>());
  return rssi[most - 1];
}

CellValues LogLikelihood(const MeasurementModel& model, const Heard& heard, const Trust& trust,
                         int cells) {
  const double least_rssi = LeastUsedRssi(heard, trust);
  CellValues sum(static_cast<std::size_t>(cells), 0.0F);
  for (const auto& [beacon, rssi] : heard) {
    if (rssi >= least_rssi) model.AddLogLikelihood(beacon, rssi, trust.temper, sum);
  }
  return sum;
}

bool ModelParts::Uses(Origin origin) const {
  switch (origin) {
    case Origin::kBeacons:
      return between_beacons;
    case Origin::kRobot:
      return by_robot;
    case Origin::kSurvey:
      break;
  }
  return true;
}

std::string ModelParts::Describe() const {
  std::string text = histogram ? "filtered map" : "log-normal";
  if (offsets) text += " + offsets";
  if (walls) text += " + walls";
  if (residual_map) text += " + residual map";
  if (bodies) text += " + bodies";
  if (by_robot) text += ", with the robot's own readings";
  return text;
}

FittedModel BuildFittedModel(const FloorGrid& grid, const Site& site,
                             const CalibrationSet& calibration, const ModelParts& parts,
                             const PathLoss& prior,
                             const std::optional<ResidualKernel>& known_kernel) {
  const int beacons = static_cast<int>(site.beacons.size());
  const std::vector<CalibrationSample> samples =
      calibration.Keeping([&](const CalibrationSample& s) { return parts.Uses(s.origin); }).samples;
  const WallCounter walls(site.plan);

  // 1. Expected RSSI from distance, beacon and walls.
  std::vector<double> crossed;
  if (parts.walls) {
    crossed.reserve(samples.size());
    for (const CalibrationSample& sample : samples) {
      const Beacon& beacon = site.beacons[static_cast<std::size_t>(sample.beacon)];
      crossed.push_back(walls.Crossed(beacon.position.head<2>(), sample.position));
    }
  }
  PathLossFitOptions fit_options;
  fit_options.prior = prior;
  fit_options.fit_offsets = parts.offsets;
  const PathLoss path_loss = FitPathLoss(samples, beacons, crossed, fit_options);
  std::vector<SampleResidual> residuals;
  residuals.reserve(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const CalibrationSample& sample = samples[i];
    const double expected =
        path_loss.MeanRssi(sample.beacon, sample.distance_m, crossed.empty() ? 0.0 : crossed[i]);
    residuals.push_back({sample.distance_m, sample.rssi_dbm - expected, sample.weight});
  }

  // 2. What the places themselves add; each sample's residual as the map would predict it from
  // elsewhere.
  std::vector<std::optional<ResidualMap>> maps(static_cast<std::size_t>(beacons));
  std::optional<ResidualKernel> kernel;
  double sd_db = path_loss.sd_db;
  if (parts.residual_map && !samples.empty()) {
    std::vector<std::vector<Residual>> by_beacon(static_cast<std::size_t>(beacons));
    std::vector<std::size_t> place_in_beacon(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      auto& of_beacon = by_beacon[static_cast<std::size_t>(samples[i].beacon)];
      place_in_beacon[i] = of_beacon.size();
      of_beacon.push_back({samples[i].position, residuals[i].residual_db});
    }
    kernel = known_kernel ? known_kernel : FitResidualKernel(by_beacon, path_loss.sd_db);
    // So that a building with a hundred beacons is fitted in seconds as well.
    const std::size_t max_bins = std::clamp<std::size_t>(
        10 * ResidualMap::kMaxBins / by_beacon.size(), 150, ResidualMap::kMaxBins);
    for (std::size_t b = 0; b < maps.size(); ++b) maps[b].emplace(by_beacon[b], *kernel, max_bins);
    std::vector<double> explained(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto& value =
          maps[static_cast<std::size_t>(samples[i].beacon)]->left_out()[place_in_beacon[i]];
      residuals[i].residual_db -= value.mean_db;
      explained[i] = value.variance_db2;
    }
    sd_db = FitSpread(residuals, explained, prior.sd_db);
  }

  // 3. Tables over the floor.
  HistogramShape shape;
  shape.columns = static_cast<int>(FurthestCell(grid, site) / shape.column_m) + 1;
  if (!parts.histogram) residuals.clear();
  MeasurementModel::Rows rows = ResidualRows(shape, sd_db, parts.bodies, residuals);
  std::vector<MeasurementModel::BeaconTable> tables(static_cast<std::size_t>(beacons));
  for (int b = 0; b < beacons; ++b) {
    const Beacon& beacon = site.beacons[static_cast<std::size_t>(b)];
    MeasurementModel::BeaconTable& table = tables[static_cast<std::size_t>(b)];
    table.reserve(grid.centres().size());
    const auto& map = maps[static_cast<std::size_t>(b)];
    const std::vector<ResidualMap::Value> off =
        map ? map->At(grid.centres()) : std::vector<ResidualMap::Value>(grid.centres().size());
    for (std::size_t cell = 0; cell < off.size(); ++cell) {
      const Eigen::Vector2d& centre = grid.centres()[cell];
      const double distance_m = BeaconDistance(beacon, site.tag_height_m, centre);
      const double crossed_here =
          parts.walls ? walls.Crossed(beacon.position.head<2>(), centre) : 0.0;
      table.push_back(MeasurementModel::Cell::Of(
          path_loss.MeanRssi(b, distance_m, crossed_here) + off[cell].mean_db,
          shape.Column(distance_m) + shape.columns * MapSdLevel(off[cell].variance_db2)));
    }
  }
  return {MeasurementModel(std::move(rows), std::move(tables)), path_loss, parts, kernel};
}

MeasurementModel BuildMap2d(const FloorGrid& grid, const Site& site,
                            const CalibrationSet& calibration) {
  HistogramShape shape;
  shape.min_db = kMinPlausibleRssiDbm;
  shape.step_db = 2.0;
  shape.bins = static_cast<int>((kMaxPlausibleRssiDbm - kMinPlausibleRssiDbm) / shape.step_db);
  shape.columns = static_cast<int>(FurthestCell(grid, site) / shape.column_m) + 1;
  std::vector<double> histogram(static_cast<std::size_t>(shape.columns * shape.bins), 0.0);
  for (const CalibrationSample& sample : calibration.samples) {
    histogram[static_cast<std::size_t>(shape.Column(sample.distance_m) * shape.bins +
                                       shape.Bin(sample.rssi_dbm))] += sample.weight;
  }
  MeasurementModel::Rows rows{shape.min_db, shape.step_db, shape.bins, {}};
  rows.log_density.reserve(histogram.size());
  for (int column = 0; column < shape.columns; ++column) {
    const auto begin = histogram.begin() + column * shape.bins;
    double readings = 0.0;
    for (auto bin = begin; bin < begin + shape.bins; ++bin) readings += *bin;
    for (auto bin = begin; bin < begin + shape.bins; ++bin) {
      const double density = readings > 0.0 ? *bin / readings / shape.step_db : 0.01;
      rows.log_density.push_back(static_cast<float>(std::log(0.99 * density + kWildDensity)));
    }
  }

  std::vector<MeasurementModel::BeaconTable> tables;
  for (const Beacon& beacon : site.beacons) {
    MeasurementModel::BeaconTable& table = tables.emplace_back();
    for (const Eigen::Vector2d& centre : grid.centres()) {
      table.push_back(MeasurementModel::Cell::Of(
          0.0, shape.Column(BeaconDistance(beacon, site.tag_height_m, centre))));
    }
  }
  return {std::move(rows), std::move(tables)};
}

}  // namespace beckon
