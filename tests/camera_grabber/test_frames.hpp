// Pictures to send through a camera_grabber.
#pragma once

#include <string>
#include <vector>

#include "common/jpeg.hpp"

namespace beckon::testing {

// A plain picture of this size and brightness.
inline std::vector<std::uint8_t> TestJpeg(int width = 64, int height = 48, int brightness = 90) {
  return EncodeJpeg(cv::Mat(height, width, CV_8UC3, cv::Scalar::all(brightness)), 90);
}
inline std::string TestJpegText(int width = 64, int height = 48, int brightness = 90) {
  const auto jpeg = TestJpeg(width, height, brightness);
  return {jpeg.begin(), jpeg.end()};
}

// A part of a stream with the boundary "frame", as a network camera sends it.
inline std::string Part(const std::string& body, const std::string& more_headers = "") {
  return "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(body.size()) +
         "\r\n" + more_headers + "\r\n" + body + "\r\n";
}

}  // namespace beckon::testing
