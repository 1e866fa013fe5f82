#pragma once

#include <opencv2/core.hpp>

#include "tools/rssi_calibration/radio_fit.hpp"

namespace beckon {

// RSSI over distance (logarithmic): every sample in its beacon's colour, freed from its beacon's
// offset and from walls; the expected RSSI, and the bands that hold half and nine tenths of the
// samples if they are as normal as the fit takes them to be. CV_8UC3.
cv::Mat DrawRadioFit(const RadioFit& fit);

}  // namespace beckon
