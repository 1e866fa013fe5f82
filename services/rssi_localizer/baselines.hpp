// The methods that probability-based location is measured against, as published, with parameters
// fitted on the same calibration readings.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "common/site.hpp"
#include "services/rssi_localizer/calibration_set.hpp"
#include "services/rssi_localizer/floor_grid.hpp"
#include "services/rssi_localizer/path_loss.hpp"

namespace beckon {

// All return a point in m, map frame. With nothing heard, or too little for the method, they return
// the area centre.
class Baselines {
 public:
  // The grid and the site have to outlive this.
  Baselines(const FloorGrid& grid, const Site& site, const CalibrationSet& calibration,
            const std::vector<CalibrationReading>& readings, const PathLoss& prior);

  // Mean of all free cells: what is known without a radio.
  Eigen::Vector2d AreaCentre() const { return area_centre_; }

  // Mean of the beacons' positions with the received power, 10^(RSSI / 10), as weight.
  // Blumenthal, Grossmann, Golatowski, Timmermann: "Weighted Centroid Localization in Zigbee-based
  // Sensor Networks", WISP 2007.
  Eigen::Vector2d WeightedCentroid(const Heard& heard) const;

  // Centre of the intersection of the squares around the beacons, half a side = estimated distance.
  // Langendoen, Reijers: "Distributed localization in wireless sensor networks", Computer Networks
  // 43, 2003.
  Eigen::Vector2d MinMax(const Heard& heard) const;

  // Centre of gravity of the cells that lie in most rings. Beacon A's ring: further than all
  // beacons that A hears more strongly than the tag, nearer than all that it hears more weakly;
  // dropped where the inner radius is not below the outer. RSSI between beacons is measured where
  // the calibration holds readings of a tag with a beacon's id, else expected from the fitted
  // log-normal model. Liu, Wu, He: "ROCRSSI++: an efficient localization algorithm for wireless
  // sensor networks", 2004/2011.
  Eigen::Vector2d Rocrssi(const Heard& heard) const;

  // The location engine of Texas Instruments' CC2431: maximum-likelihood search under the
  // log-normal model over a 0.25 m grid with hardware parameters: A of 30 to 50 in 0.5 dB, n from a
  // table of 32 values, 3 to 16 reference nodes, RSSI of -40 to -95 dBm in 0.5 dB. Texas
  // Instruments: CC2431 data sheet (SWRS034B), Application Note AN042 (SWRA095); Patwari et al.:
  // "Relative location estimation in wireless sensor networks", IEEE Trans. Signal Processing 51,
  // 2003.
  Eigen::Vector2d Cc2431(const Heard& heard) const;

 private:
  double PlanarDistance(int beacon, double rssi_dbm) const;

  const FloorGrid& grid_;
  const Site& site_;
  PathLoss path_loss_;                // one for all beacons, without walls
  std::pair<double, double> cc2431_;  // A, n of the CC2431, fitted within what its hardware accepts
  Eigen::Vector2d area_centre_;
  Eigen::MatrixXd beacon_rssi_;  // (a, b): RSSI of beacon b at beacon a, dBm
};

}  // namespace beckon
