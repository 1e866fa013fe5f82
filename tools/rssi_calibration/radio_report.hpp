#pragma once

#include <string>

#include "tools/rssi_calibration/radio_fit.hpp"

namespace beckon {

// For a person: the model, and a line for each beacon; what looks wrong is said below.
std::string RadioFitAsTable(const RadioFit& fit);
// The same numbers; null for those of a beacon that was never heard.
std::string RadioFitAsJson(const RadioFit& fit);

}  // namespace beckon
