// What ground looks like here, and what does not: learnt while driving.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace beckon {

// Histograms of intensity and two opponent colours (Swain and Ballard 1991), one of ground and one
// of all else, that slowly forget.
class ColourModel {
 public:
  void AddGround(const cv::Vec3b& bgr) { Add(ground_, bgr); }
  void AddNotGround(const cv::Vec3b& bgr) { Add(not_ground_, bgr); }
  // Call after the samples of a frame have been added.
  void EndFrame();

  // Whether any ground has been seen.
  bool knows_ground() const { return ground_.total > 0.0F; }

  // log p(colour | ground) / p(colour | not ground), within +-kLimit; 0 for a colour never seen.
  float LogRatio(const cv::Vec3b& bgr) const;

  static constexpr float kLimit = 3.0F;

 private:
  static constexpr int kIntensityBins = 32;
  static constexpr int kOpponentBins = 32;
  static constexpr int kBins = kIntensityBins * kOpponentBins * kOpponentBins;
  struct Histogram {
    std::vector<float> added = std::vector<float>(kBins, 0.0F);
    std::vector<float> smooth = std::vector<float>(kBins, 0.0F);  // of `added`, sums to total
    float total = 0.0F;
  };
  static int Bin(const cv::Vec3b& bgr);
  static void Add(Histogram& histogram, const cv::Vec3b& bgr);
  static void Smooth(Histogram& histogram);

  Histogram ground_;
  Histogram not_ground_;
};

}  // namespace beckon
