// How likely an RSSI value is, for a tag in each cell of the floor: the one interface behind which
// the measurement models stand.
//
// All of them are tables. A cell of the floor has, for each beacon, an expected RSSI and a row
// number; a row holds the log density of "measured minus expected". So a reading costs one table
// look-up per cell, whatever the model, and the models differ only in how the tables are made.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/site.hpp"
#include "services/rssi_localizer/calibration_set.hpp"
#include "services/rssi_localizer/floor_grid.hpp"
#include "services/rssi_localizer/path_loss.hpp"
#include "services/rssi_localizer/posterior.hpp"
#include "services/rssi_localizer/residual_map.hpp"

namespace beckon {

class MeasurementModel {
 public:
  // Log densities over RSSI differences [min_db, min_db + step_db * bins), one row after the other.
  // Differences outside count as the first or last bin.
  struct Rows {
    double min_db = 0.0;
    double step_db = 0.5;
    int bins = 0;
    std::vector<float> log_density;
  };
  // What is looked up of a cell: small, since a big building has millions of them.
  struct Cell {
    std::int16_t expected = 0;  // RSSI, in kStep dBm
    std::uint16_t row = 0;

    static constexpr float kStep = 1.0F / 128.0F;
    static Cell Of(double expected_dbm, int row);
    float expected_dbm() const { return kStep * static_cast<float>(expected); }
  };
  using BeaconTable = std::vector<Cell>;  // per free cell

  MeasurementModel(Rows rows, std::vector<BeaconTable> beacons)
      : rows_(std::move(rows)), beacons_(std::move(beacons)) {}

  // Adds weight * log p(rssi of this beacon | tag in cell) for every free cell.
  void AddLogLikelihood(int beacon, double rssi_dbm, double weight, CellValues& sum) const;

  // The same for some cells: sum[i] belongs to cells[i].
  void AddLogLikelihood(int beacon, double rssi_dbm, double weight, std::span<const int> cells,
                        CellValues& sum) const;

  // The same model for these cells only, numbered as they come: their tables then lie side by side.
  MeasurementModel Restricted(std::span<const int> cells) const;

  // The same for one cell.
  double LogLikelihoodAt(int beacon, double rssi_dbm, int cell) const;

 private:
  // Adds to sum[i] what the reading says of cell cell_at(i).
  template <typename CellAt>
  void AddAt(int beacon, double rssi_dbm, double weight, const CellAt& cell_at,
             CellValues& sum) const;

  Rows rows_;
  std::vector<BeaconTable> beacons_;
};

// How far the readings of one moment are believed. They have errors in common (the body beside the
// tag, its own power), and a body weakens readings but never strengthens them.
struct Trust {
  double temper = 0.6;  // weight of each log-likelihood: at the right one the posterior is as wide
                        // as the errors are
  int strongest = 1'000'000;  // only this many of the strongest readings are used
};

// The weakest RSSI that is still used; minus infinity where all are.
double LeastUsedRssi(const Heard& heard, const Trust& trust);

// log p(heard | tag in cell) for every free cell, tempered, up to a constant.
CellValues LogLikelihood(const MeasurementModel& model, const Heard& heard, const Trust& trust,
                         int cells);

// What a model of the family log-normal / filtered map consists of.
struct ModelParts {
  bool offsets = true;        // every beacon has its own transmit power and antenna
  bool walls = false;         // attenuation by walls that the straight line crosses
  bool residual_map = false;  // smooth residual of each beacon over the floor
  bool bodies = true;         // people in the way, more of them than at calibration
  bool histogram = false;     // measured distribution of the residual, by distance, in place of the
                              // log-normal one where there are enough readings: the filtered map

  // Fitted to these as well as to what was surveyed.
  bool between_beacons = true;  // what beacons hear of each other
  bool by_robot = true;         // what the robot heard, where it believed itself to be

  bool Uses(Origin origin) const;
  std::string Describe() const;
};

// Log-normal with a robust tail: one reading in twenty has three times the spread, and one in a
// hundred may be anything. With parts.histogram the filtered map: the joint histogram of residual
// and distance, smoothed in both directions, each column mixed with the log-normal one in the
// proportion of readings it holds. With parts.bodies some of the readings lose more than that. An
// empty calibration leaves the prior.
struct FittedModel {
  MeasurementModel model;
  PathLoss path_loss;
  ModelParts parts;
  std::optional<ResidualKernel> kernel;  // of the residual map, where it is a part
};
// `kernel`: as fitted before to (much of) the same readings; none: it is fitted, which takes long.
FittedModel BuildFittedModel(const FloorGrid& grid, const Site& site,
                             const CalibrationSet& calibration, const ModelParts& parts,
                             const PathLoss& prior,
                             const std::optional<ResidualKernel>& kernel = std::nullopt);

// The 2-D map of Lin and Song: the joint histogram of RSSI and distance as it was measured, over
// all beacons, 2 dB by 0.5 m. p(RSSI | distance) is a column of it, so that the floor plan and not
// the calibration walk is the prior over distance. Distances at which nothing was measured say
// nothing.
MeasurementModel BuildMap2d(const FloorGrid& grid, const Site& site,
                            const CalibrationSet& calibration);

}  // namespace beckon
