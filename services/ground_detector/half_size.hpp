// Pictures in grey at half their size, and values between their pixels.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace beckon {

// Pixel of a half-size picture to pixel of the full one: the centre of the first is at 0.5.
inline Eigen::Matrix3d FullFromHalf() {
  Eigen::Matrix3d full_from_half;
  full_from_half << 2.0, 0.0, 0.5, 0.0, 2.0, 0.5, 0.0, 0.0, 1.0;
  return full_from_half;
}

// Grey level between pixels of a CV_8UC1 picture of any size, bilinear; false at the border and
// beyond. Runs some 100 000 times a frame.
template <typename Scalar>
bool Interpolate(const cv::Mat& grey, Scalar u, Scalar v, Scalar& value) {
  if (!(u >= Scalar(0) && v >= Scalar(0))) return false;
  const int column = static_cast<int>(u);
  const int row = static_cast<int>(v);
  if (column + 1 >= grey.cols || row + 1 >= grey.rows) return false;
  const Scalar a = u - static_cast<Scalar>(column);
  const Scalar b = v - static_cast<Scalar>(row);
  const auto* upper = grey.ptr<std::uint8_t>(row) + column;
  const auto* lower = grey.ptr<std::uint8_t>(row + 1) + column;
  const Scalar top = upper[0] + a * static_cast<Scalar>(upper[1] - upper[0]);
  const Scalar bottom = lower[0] + a * static_cast<Scalar>(lower[1] - lower[0]);
  value = top + b * (bottom - top);
  return true;
}

}  // namespace beckon
