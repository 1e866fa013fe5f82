#include "tools/rssi_calibration/radio_report.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/text.hpp"

namespace beckon {
namespace {

constexpr int kFewSamples = 10;
constexpr double kFarOffDb = 8.0;  // twice the spread that is expected of beacons' powers

std::string Line(const std::string& name, const std::string& offset, const std::string& range,
                 const ResidualStatistics& residuals) {
  std::string line = Format("%-12s %8d %8d  %s  %s", name.c_str(), residuals.readings,
                            residuals.samples, offset.c_str(), range.c_str());
  if (residuals.samples > 0) {
    line += Format("  %+7.1f  %6.1f  %6.1f  %4.0f %%", residuals.mean_db, residuals.sd_db,
                   residuals.robust_sd_db, 100.0 * residuals.wild_share);
  }
  return line + "\n";
}

nlohmann::json JsonOf(const ResidualStatistics& residuals) {
  return {{"readings", residuals.readings},         {"samples", residuals.samples},
          {"mean_db", residuals.mean_db},           {"sd_db", residuals.sd_db},
          {"robust_sd_db", residuals.robust_sd_db}, {"wild_share", residuals.wild_share}};
}

}  // namespace

std::string RadioFitAsTable(const RadioFit& fit) {
  const PathLoss& loss = fit.path_loss;
  std::string text = fit.site.name + "\nmodel          " + fit.choice.Describe() +
                     Format("\npath loss      %.1f dBm at 1 m, exponent %.2f, spread %.1f dB",
                            loss.rssi_at_1m_dbm, loss.exponent, loss.sd_db);
  if (fit.choice.parts.walls) text += Format(", %.1f dB for each wall", loss.wall_db);
  for (const Trial& trial : fit.choice.trials) {
    text += Format("\ntried          %s: %+.3f +- %.3f, %s", trial.what.c_str(), trial.gain,
                   trial.standard_error, trial.kept ? "kept" : "left out");
  }
  text +=
      "\n\nbeacon       readings  samples    offset      heard from    residual mean, sd, robust "
      "sd, wild\n";
  std::string remarks;
  for (const BeaconFit& beacon : fit.beacons) {
    const bool is_heard = beacon.residuals.samples > 0;
    text += Line(beacon.id,
                 fit.choice.parts.offsets ? Format("%+5.1f dB", beacon.offset_db) : "       -",
                 is_heard ? Format("%5.1f to %5.1f m", beacon.nearest_m, beacon.farthest_m)
                          : "         never  ",
                 beacon.residuals);
    if (!is_heard) {
      remarks += "  " + beacon.id + " was never heard: off, out of reach, or its id is another\n";
    } else if (beacon.residuals.samples < kFewSamples) {
      remarks += "  " + beacon.id + " was heard in few places\n";
    } else if (std::abs(beacon.offset_db + beacon.residuals.mean_db) > kFarOffDb) {
      remarks += "  " + beacon.id +
                 Format(
                     " is %+.0f dB off what its place lets expect: other power, antenna covered, "
                     "or its position is wrong\n",
                     beacon.offset_db + beacon.residuals.mean_db);
    }
  }
  text += Line("all", "        ", "                ", fit.residuals);
  if (!remarks.empty()) text += "\nlook at:\n" + remarks;
  return text;
}

std::string RadioFitAsJson(const RadioFit& fit) {
  nlohmann::json beacons = nlohmann::json::array();
  for (const BeaconFit& beacon : fit.beacons) {
    beacons.push_back({{"id", beacon.id},
                       {"offset_db", beacon.offset_db},
                       {"nearest_m", beacon.nearest_m},
                       {"farthest_m", beacon.farthest_m},
                       {"residuals", JsonOf(beacon.residuals)}});
  }
  nlohmann::json tried = nlohmann::json::array();
  for (const Trial& trial : fit.choice.trials) {
    tried.push_back({{"what", trial.what},
                     {"gain", trial.gain},
                     {"standard_error", trial.standard_error},
                     {"kept", trial.kept}});
  }
  const nlohmann::json all = {{"site", fit.site.name},
                              {"model", fit.choice.parts.Describe()},
                              {"tried", tried},
                              {"temper", fit.choice.trust.temper},
                              {"held_back_epochs", fit.choice.held_back_epochs},
                              {"held_back_error_m", fit.choice.held_back_error_m},
                              {"rssi_at_1m_dbm", fit.path_loss.rssi_at_1m_dbm},
                              {"exponent", fit.path_loss.exponent},
                              {"sd_db", fit.path_loss.sd_db},
                              {"wall_db", fit.path_loss.wall_db},
                              {"residuals", JsonOf(fit.residuals)},
                              {"beacons", beacons}};
  return all.dump(2) + "\n";
}

}  // namespace beckon
