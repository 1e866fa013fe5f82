// JPEG files in memory: what every camera speaks and every CAMERA message carries.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace beckon {

// `image`: CV_8UC3, BGR. `quality`: 1 to 100. Chroma is halved in both directions, as cameras do.
std::vector<std::uint8_t> EncodeJpeg(const cv::Mat& image, int quality);

// Width and height by the header. Throws std::invalid_argument, with what is wrong, for what is not
// a JPEG file from its first marker to its last (zeros and line ends after the last marker are let
// pass: cameras pad). The compressed data themselves are not looked at.
cv::Size InspectJpeg(std::span<const std::uint8_t> jpeg);

}  // namespace beckon
