// Pictures for people.
#pragma once

#include <opencv2/core.hpp>
#include <span>

#include "services/ground_detector/ground_detector.hpp"

namespace beckon {

// The frame with what was found drawn over it: ground green, undetermined yellow, the rest as it
// is; the foot line (where ground first ends, from below, in each column) in red; matched features
// as dots: green ground, red off-ground, yellow undetermined. `bgr`: CV_8UC3; `labels`: CV_8UC1 of
// the same size, as in GroundFrame. Throws std::invalid_argument for other shapes.
cv::Mat DrawOverlay(const cv::Mat& bgr, const cv::Mat& labels,
                    std::span<const ClassifiedFeature> features = {});

}  // namespace beckon
