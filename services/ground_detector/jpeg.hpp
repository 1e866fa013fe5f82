// Decoding of camera frames.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

namespace beckon {

// One JPEG file to CV_8UC3 (blue, green, red). Throws std::invalid_argument, saying why, for
// anything that is not a complete, undamaged JPEG of exactly `width` x `height` pixels: a frame of
// another size comes from another camera, and what a truncated file lacks would be shown as grey
// floor.
cv::Mat DecodeJpeg(std::span<const std::uint8_t> jpeg, int width, int height);

}  // namespace beckon
