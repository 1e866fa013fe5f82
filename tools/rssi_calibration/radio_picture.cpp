#include "tools/rssi_calibration/radio_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "common/text.hpp"

namespace beckon {
namespace {

constexpr int kWidth = 1000;
constexpr int kHeight = 640;
const cv::Rect kPlot(80, 50, 760, 520);
constexpr int kLegendStep = 20;
constexpr double kHalf = 0.674;        // standard deviations to either side of half of a normal
constexpr double kNineTenths = 1.645;  // and of nine tenths
const cv::Scalar kInk(60, 60, 60);

void Write(cv::Mat& picture, const std::string& text, const cv::Point& at, double size = 0.45) {
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, size, kInk, 1, cv::LINE_AA);
}

cv::Scalar ColourOf(int beacon, int beacons) {
  const cv::Mat hsv(1, 1, CV_8UC3,
                    cv::Scalar(180.0 * beacon / std::max(1, beacons), beacon % 2 == 0 ? 220 : 160,
                               beacon % 3 == 0 ? 210 : 160));
  cv::Mat bgr;
  cv::cvtColor(hsv, bgr, cv::COLOR_HSV2BGR);
  const auto& colour = bgr.at<cv::Vec3b>(0, 0);
  return {static_cast<double>(colour[0]), static_cast<double>(colour[1]),
          static_cast<double>(colour[2])};
}

// As it would be had its beacon the common power, and no wall been in the way.
double FreedRssi(const RadioFit& fit, const FittedSample& sample) {
  return fit.path_loss.MeanRssi(sample.distance_m) + sample.residual_db;
}

// Distances run logarithmically from left to right, powers upwards.
struct Axes {
  double nearest_m, farthest_m, weakest_dbm, strongest_dbm;

  explicit Axes(const RadioFit& fit)
      : nearest_m(1.0), farthest_m(10.0), weakest_dbm(-80.0), strongest_dbm(-50.0) {
    for (const FittedSample& sample : fit.samples) {
      nearest_m = std::min(nearest_m, sample.distance_m);
      farthest_m = std::max(farthest_m, sample.distance_m);
      weakest_dbm = std::min(weakest_dbm, FreedRssi(fit, sample));
      strongest_dbm = std::max(strongest_dbm, FreedRssi(fit, sample));
    }
    weakest_dbm = 10.0 * std::floor(weakest_dbm / 10.0);
    strongest_dbm = 10.0 * std::ceil(strongest_dbm / 10.0);
  }
  int Column(double distance_m) const {
    const double share = std::log(distance_m / nearest_m) / std::log(farthest_m / nearest_m);
    return kPlot.x + static_cast<int>(std::lround(share * kPlot.width));
  }
  int Row(double rssi_dbm) const {
    const double share = (strongest_dbm - rssi_dbm) / (strongest_dbm - weakest_dbm);
    return kPlot.y + static_cast<int>(std::lround(share * kPlot.height));
  }
  double DistanceAt(int column) const {
    return nearest_m *
           std::pow(farthest_m / nearest_m, static_cast<double>(column - kPlot.x) / kPlot.width);
  }
};

void DrawAxes(const Axes& axes, cv::Mat& picture) {
  const cv::Scalar grid(225, 225, 225);
  for (double rssi = axes.weakest_dbm; rssi <= axes.strongest_dbm; rssi += 10.0) {
    const int row = axes.Row(rssi);
    cv::line(picture, {kPlot.x, row}, {kPlot.x + kPlot.width, row}, grid);
    Write(picture, Format("%4.0f", rssi), {kPlot.x - 45, row + 5});
  }
  for (const double distance : {0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0, 50.0, 100.0}) {
    if (distance < axes.nearest_m || distance > axes.farthest_m) continue;
    const int column = axes.Column(distance);
    cv::line(picture, {column, kPlot.y}, {column, kPlot.y + kPlot.height}, grid);
    Write(picture, Format("%g", distance), {column - 8, kPlot.y + kPlot.height + 20});
  }
  cv::rectangle(picture, kPlot, kInk);
  Write(picture, "distance, m", {kPlot.x + kPlot.width / 2 - 40, kPlot.y + kPlot.height + 45});
  Write(picture, "RSSI, dBm", {kPlot.x - 70, kPlot.y - 15});
}

}  // namespace

cv::Mat DrawRadioFit(const RadioFit& fit) {
  cv::Mat picture(kHeight, kWidth, CV_8UC3, cv::Scalar::all(255));
  const Axes axes(fit);
  const PathLoss& loss = fit.path_loss;

  cv::Mat inside = picture(kPlot);
  for (const auto& [deviations, colour] :
       {std::pair{kNineTenths, cv::Scalar(250, 240, 228)}, {kHalf, cv::Scalar(245, 222, 195)}}) {
    for (int column = kPlot.x; column < kPlot.x + kPlot.width; ++column) {
      const double expected = loss.MeanRssi(axes.DistanceAt(column));
      const cv::Point offset = kPlot.tl();
      cv::line(inside, cv::Point(column, axes.Row(expected + deviations * loss.sd_db)) - offset,
               cv::Point(column, axes.Row(expected - deviations * loss.sd_db)) - offset, colour);
    }
  }
  DrawAxes(axes, picture);
  const int beacons = static_cast<int>(fit.beacons.size());
  for (const FittedSample& sample : fit.samples) {
    const cv::Point at(axes.Column(sample.distance_m), axes.Row(FreedRssi(fit, sample)));
    cv::circle(picture, at, 2, ColourOf(sample.beacon, beacons), cv::FILLED, cv::LINE_AA);
  }
  for (int column = kPlot.x; column + 1 < kPlot.x + kPlot.width; ++column) {
    cv::line(
        inside, cv::Point(column, axes.Row(loss.MeanRssi(axes.DistanceAt(column)))) - kPlot.tl(),
        cv::Point(column + 1, axes.Row(loss.MeanRssi(axes.DistanceAt(column + 1)))) - kPlot.tl(),
        kInk, 2, cv::LINE_AA);
  }

  Write(picture,
        fit.site.name + Format(": %.1f dBm at 1 m, exponent %.2f, spread %.1f dB; bands: half and "
                               "nine tenths",
                               loss.rssi_at_1m_dbm, loss.exponent, loss.sd_db),
        {kPlot.x, 25}, 0.5);
  const int column = kPlot.x + kPlot.width + 20;
  const int rows = kPlot.height / kLegendStep;
  for (int i = 0; i < std::min(beacons, rows); ++i) {
    const int row = kPlot.y + 10 + kLegendStep * i;
    cv::circle(picture, {column, row}, 4, ColourOf(i, beacons), cv::FILLED, cv::LINE_AA);
    const bool is_cut = i + 1 == rows && beacons > rows;
    const BeaconFit& beacon = fit.beacons[static_cast<std::size_t>(i)];
    Write(picture,
          is_cut ? Format("and %d more", beacons - i)
                 : beacon.id + (fit.choice.parts.offsets ? Format("  %+.1f dB", beacon.offset_db)
                                                         : std::string()),
          {column + 10, row + 5});
  }
  return picture;
}

}  // namespace beckon
