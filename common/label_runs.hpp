// Run-length coding of label images, as in beckon.ground_t.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace beckon {

enum GroundLabel : std::uint8_t { kUndetermined = 0, kGround = 1, kNotGround = 2 };

// `labels`: CV_8UC1, values 0 to 3. Throws std::invalid_argument otherwise.
std::vector<std::uint8_t> EncodeLabels(const cv::Mat& labels);

// Throws std::invalid_argument when the runs do not fill width x height exactly, or are cut short,
// or when the size is not between 1 x 1 and 16384 x 16384.
cv::Mat DecodeLabels(std::span<const std::uint8_t> runs, int width, int height);

}  // namespace beckon
