// What ground looks like here, and what does not: learnt while driving.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace beckon {

// Histograms of intensity and two opponent colours (Swain and Ballard 1991), one of ground and one
// of all else, that slowly forget.
class ColourModel {
 public:
  void AddGround(const cv::Vec3b& bgr);
  void AddNotGround(const cv::Vec3b& bgr) { Add(not_ground_, bgr); }
  // Call after the samples of a frame have been added.
  void EndFrame();

  // Whether any ground has been seen.
  bool knows_ground() const { return ground_.total > 0.0F; }

  // log p(colour | ground) / p(colour | not ground), within +-kLimit. A colour never seen speaks
  // against ground: a place has few floors and many things.
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
  static int ChromaBin(const cv::Vec3b& bgr);
  bool MayBeLitOtherwise(const cv::Vec3b& bgr) const;
  static void Add(Histogram& histogram, const cv::Vec3b& bgr);
  static void Smooth(Histogram& histogram);

  Histogram ground_;
  Histogram not_ground_;
  // Ground by hue and saturation alone, with the mean intensity of each bin.
  std::vector<float> chroma_ = std::vector<float>(kOpponentBins * kOpponentBins, 0.0F);
  std::vector<float> chroma_light_ = std::vector<float>(kOpponentBins * kOpponentBins, 0.0F);
};

}  // namespace beckon
