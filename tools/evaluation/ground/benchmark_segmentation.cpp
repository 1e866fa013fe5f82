// benchmark_segmentation SEQUENCE...: the detector's segmentation beside
// OpenCV's mean shift on the same frames: how long each takes, and how much of
// the true border of the ground each finds.
#include <CLI/CLI.hpp>
#include <ctime>
#include <exception>
#include <functional>
#include <iomanip>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/label_runs.hpp"
#include "common/statistics.hpp"
#include "services/ground_detector/mean_shift.hpp"
#include "tools/evaluation/ground/scoring.hpp"

namespace beckon {
namespace {

constexpr int kScale = 10;                  // as in the detector
constexpr double kSpaceRadiusPx = 10.0;     // of OpenCV's kernel
constexpr double kColourRadiusGrey = 20.0;  // of OpenCV's kernel
constexpr int kTolerancePx = 2;

// 255 where a pixel differs from its right or lower neighbour.
cv::Mat Borders(const cv::Size& size, const std::function<bool(cv::Point, cv::Point)>& differ) {
  cv::Mat borders(size, CV_8UC1, cv::Scalar(0));
  for (int v = 0; v + 1 < size.height; ++v) {
    for (int u = 0; u + 1 < size.width; ++u) {
      const cv::Point here(u, v);
      if (differ(here, {u + 1, v}) || differ(here, {u, v + 1}))
        borders.at<std::uint8_t>(here) = 255;
    }
  }
  return borders;
}

struct Score {
  std::vector<double> ms;
  std::vector<double> recalls;    // share of the true border with a border within the tolerance
  std::vector<double> densities;  // share of all pixels that are border: all-border recalls all

  void Add(double time_ms, const cv::Mat& borders, const cv::Mat& truth) {
    cv::Mat reach;
    constexpr int kSide = 2 * kTolerancePx + 1;
    cv::dilate(borders, reach, cv::Mat::ones(kSide, kSide, CV_8UC1));
    ms.push_back(time_ms);
    recalls.push_back(static_cast<double>(cv::countNonZero(truth & reach)) /
                      std::max(cv::countNonZero(truth), 1));
    densities.push_back(static_cast<double>(cv::countNonZero(borders)) /
                        static_cast<double>(borders.total()));
  }
  void Print(const char* name) const {
    std::cout << std::left << std::setw(26) << name << std::right << std::fixed
              << std::setprecision(2) << std::setw(10) << Quantile(ms, 0.5) << std::setw(10)
              << 100.0 * cv::mean(recalls)[0] << std::setw(10) << 100.0 * cv::mean(densities)[0]
              << '\n';
  }
};

// Processor time, which other programs on the same machine do not lengthen.
template <typename Work>
double Milliseconds(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void Compare(const cv::Mat& bgr, const cv::Mat& labels, Score& ours, Score& opencv) {
  const cv::Mat truth = Borders(labels.size(), [&](cv::Point a, cv::Point b) {
    const auto label = labels.at<std::uint8_t>(a);
    const auto other = labels.at<std::uint8_t>(b);
    return label != kUndetermined && other != kUndetermined && label != other;
  });
  cv::Mat ids;
  const double our_ms = Milliseconds([&] {
    const MeanShiftOptions options;
    cv::Mat cells;
    cv::resize(bgr, cells, bgr.size() / kScale, 0.0, 0.0, cv::INTER_AREA);
    ids = RefineSegments(
        bgr, MeanShiftSegments(HsiFromBgr(cells, options.colourless_saturation), options));
  });
  ours.Add(our_ms,
           Borders(ids.size(),
                   [&](cv::Point a, cv::Point b) { return ids.at<int>(a) != ids.at<int>(b); }),
           truth);
  cv::Mat modes;
  const double opencv_ms = Milliseconds(
      [&] { cv::pyrMeanShiftFiltering(bgr, modes, kSpaceRadiusPx, kColourRadiusGrey); });
  opencv.Add(opencv_ms,
             Borders(modes.size(),
                     [&](cv::Point a, cv::Point b) {
                       return cv::norm(cv::Vec3i(modes.at<cv::Vec3b>(a)) -
                                       cv::Vec3i(modes.at<cv::Vec3b>(b))) > 0.5 * kColourRadiusGrey;
                     }),
             truth);
}

void Run(const std::string& folder, std::size_t step) {
  const Sequence sequence = LoadSequence(folder);
  Score ours;
  Score opencv;
  for (std::size_t i = 0; i < sequence.frames.size(); i += step) {
    const SequenceFrame& frame = sequence.frames[i];
    const cv::Mat bgr = cv::imread(frame.picture.string());
    const cv::Mat labels = cv::imread(frame.truth.string(), cv::IMREAD_GRAYSCALE);
    if (bgr.empty() || labels.size() != bgr.size()) continue;
    Compare(bgr, labels, ours, opencv);
  }
  std::cout << std::left << std::setw(26) << sequence.name << std::right << std::setw(10)
            << "CPU ms" << std::setw(10) << "recall %" << std::setw(10) << "border %" << '\n';
  ours.Print("segments of the detector");
  opencv.Print("cv::pyrMeanShiftFiltering");
  std::cout << "times as fast: " << Quantile(opencv.ms, 0.5) / Quantile(ours.ms, 0.5) << "\n\n";
}

}  // namespace
}  // namespace beckon

int main(int argc, char** argv) {
  CLI::App app(
      "Compares the detector's segmentation with "
      "cv::pyrMeanShiftFiltering on the same frames:\n"
      "time, true ground border found within 2 pixels, and how much "
      "border each draws at all.",
      "benchmark_segmentation");
  std::vector<std::string> sequences;
  std::size_t step = 5;
  app.add_option("SEQUENCE", sequences, "Sequence folders with truth")->required();
  app.add_option("--step", step, "Takes every Nth frame")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    for (const std::string& sequence : sequences) beckon::Run(sequence, step);
  } catch (const std::exception& error) {
    std::cerr << "benchmark_segmentation: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
