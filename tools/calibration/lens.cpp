#include "tools/calibration/lens.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>

#include "common/text.hpp"

namespace beckon {

Eigen::Vector2d Lens::Undistorted(const Eigen::Vector2d& pixel) const {
  const cv::Matx33d matrix(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0);
  const std::vector<cv::Point2d> in = {{pixel.x(), pixel.y()}};
  std::vector<cv::Point2d> out;
  const std::vector<double> coefficients(distortion.begin(), distortion.end());
  cv::undistortPoints(in, out, matrix, coefficients, cv::noArray(), matrix,
                      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-9));
  return {out[0].x, out[0].y};
}

Lens CalibrateLens(const std::vector<std::vector<BoardCorner>>& pictures, const cv::Size& size) {
  if (pictures.size() < kLeastLensPictures) {
    throw CalibrationError(std::to_string(pictures.size()) +
                           " pictures of a board are too few to "
                           "tell the lens from: " +
                           std::to_string(kLeastLensPictures) +
                           " or more, the board held at other angles in each");
  }
  std::vector<std::vector<cv::Point3f>> places;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const auto& corners : pictures) {
    places.emplace_back();
    pixels.emplace_back();
    for (const BoardCorner& corner : corners) {
      places.back().emplace_back(static_cast<float>(corner.board_m.x()),
                                 static_cast<float>(corner.board_m.y()), 0.0F);
      pixels.back().emplace_back(static_cast<float>(corner.pixel.x()),
                                 static_cast<float>(corner.pixel.y()));
    }
  }
  cv::Mat matrix = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat distortion, deviations, unused_pose, unused_error;
  std::vector<cv::Mat> rotations, translations;
  Lens lens;
  try {
    lens.rms_px =
        cv::calibrateCamera(places, pixels, size, matrix, distortion, rotations, translations,
                            deviations, unused_pose, unused_error, cv::CALIB_FIX_K3);
  } catch (const cv::Exception& error) {
    throw CalibrationError(std::string("no lens explains the pictures: ") + error.what());
  }
  lens.fx = matrix.at<double>(0, 0);
  lens.fy = matrix.at<double>(1, 1);
  lens.cx = matrix.at<double>(0, 2);
  lens.cy = matrix.at<double>(1, 2);
  std::copy_n(distortion.ptr<double>(), 5, lens.distortion.begin());

  const double uncertainty =
      std::max(deviations.at<double>(0) / lens.fx, deviations.at<double>(1) / lens.fy);
  constexpr double kWorstUncertainty = 0.01;
  constexpr double kWorstRmsPx = 1.5;
  if (!(uncertainty < kWorstUncertainty)) {
    throw CalibrationError(
        Format("the pictures of the board leave the focal length uncertain by %.1f %%: hold it "
               "at other angles, tilted by 30 degrees and more, near the corners too",
               100.0 * uncertainty));
  }
  if (!(lens.rms_px < kWorstRmsPx)) {
    throw CalibrationError(
        Format("no lens explains the pictures of the board to better than %.1f pixels: is it "
               "flat, and are columns and rows right?",
               lens.rms_px));
  }
  return lens;
}

}  // namespace beckon
