// Which parts of the fitted model a site is better off with, and how far its readings can be
// trusted: decided by calibration readings held back from the fit, so that no site gets worse by a
// richer description.
#pragma once

#include <string>
#include <vector>

#include "services/rssi_localizer/measurement_model.hpp"

namespace beckon {

// Something that was tried, and what it gained in log score per held-back epoch over the model
// without it.
struct Trial {
  std::string what;
  double gain = 0.0;
  double standard_error = 0.0;
  bool kept = false;
};

struct ModelChoice {
  ModelParts parts{.offsets = true,
                   .walls = false,
                   .residual_map = false,
                   .histogram = true,
                   .between_beacons = false,
                   .by_robot = false};
  Trust trust;
  Averaging averaging = Averaging::kPower;
  std::optional<ResidualKernel> kernel;
  int held_back_epochs = 0;          // that were judged; 0: there was nothing to judge by
  double held_back_error_m = 0.0;    // their mean error
  double held_back_log_score = 0.0;  // mean log probability density at the true place, per m^2
  std::vector<Trial> trials;         // in the order in which they were made

  std::string Describe() const;
};

// Five-fold: the floor is cut into squares of a metre, and all readings taken in a fifth of them
// are held back together, so that a model is judged in places that it has not seen; readings from
// beacon to beacon are held back in both directions. From the log-normal model with bodies in the
// way, parts are added one by one where they raise the log score by more than half its standard
// error over the squares; then the bodies are taken out if that does, and readings averaged in dB,
// not as power, if that raises it at all. Few squares know little: the trust then stays low. Fewer
// than three squares: the default choice.
ModelChoice ChooseModel(const Site& site, const std::vector<CalibrationReading>& calibration,
                        const PathLoss& prior);

}  // namespace beckon
