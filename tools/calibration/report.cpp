#include "tools/calibration/report.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "common/frames.hpp"
#include "common/text.hpp"

namespace beckon {
namespace {

constexpr int kFarthestM = 6;

// Range that a pixel is worth at this range straight ahead, m.
double PixelWorth(const GroundCamera& camera, double range_m) {
  const auto pixel = camera.PixelFromGround({range_m, 0.0});
  if (!pixel) return std::nan("");
  const auto above = camera.GroundFromPixel(*pixel - Eigen::Vector2d(0.0, 0.5));
  const auto below = camera.GroundFromPixel(*pixel + Eigen::Vector2d(0.0, 0.5));
  return above && below ? above->norm() - below->norm() : std::nan("");
}

}  // namespace

std::string DescribeMount(const Session& session, const Mount& mount) {
  const GroundCamera& camera = mount.camera;
  std::string text;
  const MountInput& input = session.mount;
  if (session.lens_pictures > 0) {
    text += Format("lens          from %zu pictures, off by %.2f px (rms)\n", session.lens_pictures,
                   input.lens->rms_px);
  } else if (input.lens) {
    text += "lens          as given\n";
  } else {
    text += "lens          taken to be free of distortion and centred; the focal length fitted\n";
  }
  text += Format("focal length  %.1f x %.1f px, centre (%.1f, %.1f)\n", camera.fx, camera.fy,
                 camera.cx, camera.cy);
  text += Format("mount         %.3f m high, %.2f degrees down, %.2f to the left, rolled by %.2f\n",
                 camera.height_m, DegreesFromRadians(camera.tilt_down_rad),
                 DegreesFromRadians(mount.pan_rad), DegreesFromRadians(mount.roll_rad));
  text += Format("used          %zu boards, %zu marks\n", input.boards.size(), input.marks.size());
  text += Format("reprojection  %.2f px (rms); worst %.2f px, in %s\n\n", mount.rms_px,
                 mount.worst_px, mount.worst_name.c_str());
  text += "  range   a pixel is    reprojection    calibration\n";
  for (int range = 1; range <= kFarthestM; ++range) {
    const double pixel_m = PixelWorth(camera, range);
    const double sigma_m = mount.RangeSigma(range);
    text += Format("  %3d m   %7.3f m    +- %6.3f m    +- %6.3f m  (%.1f %%)\n", range, pixel_m,
                   mount.rms_px * pixel_m, sigma_m, 100.0 * sigma_m / range);
  }
  return text;
}

cv::Mat DrawGrid(const Session& session, const Mount& mount) {
  const GroundCamera& camera = mount.camera;
  cv::Mat picture = session.picture.clone();
  const auto pixel_at = [&](double x, double y) -> std::optional<cv::Point2d> {
    const auto ideal = camera.PixelFromGround({x, y});
    if (!ideal) return std::nullopt;
    const Eigen::Vector2d taken = camera.Distorted(*ideal);
    // Far outside of the picture distortion bends lines back into it.
    const bool near_picture = std::abs(ideal->x() - camera.cx) < camera.width &&
                              std::abs(ideal->y() - camera.cy) < camera.height;
    if (!near_picture) return std::nullopt;
    return cv::Point2d(taken.x(), taken.y());
  };
  const auto line = [&](double x0, double y0, double x1, double y1, bool is_metre) {
    const cv::Scalar colour = is_metre ? cv::Scalar(60, 220, 60) : cv::Scalar(60, 160, 60);
    constexpr int kSteps = 60;
    for (int i = 0; i < kSteps; ++i) {
      const auto from =
          pixel_at(std::lerp(x0, x1, 1.0 * i / kSteps), std::lerp(y0, y1, 1.0 * i / kSteps));
      const auto to =
          pixel_at(std::lerp(x0, x1, (i + 1.0) / kSteps), std::lerp(y0, y1, (i + 1.0) / kSteps));
      if (from && to) cv::line(picture, *from, *to, colour, 1, cv::LINE_AA);
    }
  };
  for (int half = -2 * kFarthestM; half <= 2 * kFarthestM; ++half) {
    const double place = 0.5 * half;
    if (half > 0) line(place, -kFarthestM, place, kFarthestM, half % 2 == 0);
    line(0.1, place, kFarthestM, place, half % 2 == 0);
  }
  for (int range = 1; range <= kFarthestM; ++range) {
    if (const auto pixel = pixel_at(range, 0.0)) {
      cv::putText(picture, std::to_string(range) + " m", *pixel + cv::Point2d(4.0, -4.0),
                  cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar(0, 255, 255), 1, cv::LINE_AA);
    }
  }
  const auto dot = [&](const Eigen::Vector2d& pixel) {
    cv::circle(picture, cv::Point2d(pixel.x(), pixel.y()), 2, cv::Scalar(40, 40, 255), cv::FILLED,
               cv::LINE_AA);
  };
  for (const FloorMark& mark : session.mount.marks) dot(mark.pixel);
  for (const FloorBoard& board : session.mount.boards) {
    for (const BoardCorner& corner : board.corners) dot(corner.pixel);
  }
  return picture;
}

}  // namespace beckon
