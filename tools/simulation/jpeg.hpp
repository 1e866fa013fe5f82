// JPEG compression of rendered frames.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace beckon::simulation {

// `image`: CV_8UC3, BGR. Chroma is halved in both directions, as cameras do.
std::vector<std::uint8_t> EncodeJpeg(const cv::Mat& image, int quality);

// The same, but with the quality lowered step by step until it takes no more than `max_bytes`.
std::vector<std::uint8_t> EncodeJpegWithin(const cv::Mat& image, int quality,
                                           std::size_t max_bytes);

}  // namespace beckon::simulation
