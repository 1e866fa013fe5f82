// A calibration for people: numbers, and the floor's grid over the picture.
#pragma once

#include <string>

#include "tools/calibration/session.hpp"

namespace beckon {

// Reprojection error in pixels, and at 1 to 6 m what it and the calibration's uncertainty are worth
// in metres.
std::string DescribeMount(const Session& session, const Mount& mount);

// The picture (CV_8UC3) with lines on the floor every half metre, each whole metre labelled, to 6 m
// ahead; the corners and marks that were used as dots.
cv::Mat DrawGrid(const Session& session, const Mount& mount);

}  // namespace beckon
