#include "tools/simulation/jpeg.hpp"

#include <turbojpeg.h>

#include <memory>
#include <stdexcept>

namespace beckon::simulation {

std::vector<std::uint8_t> EncodeJpeg(const cv::Mat& image, int quality) {
  CV_Assert(image.type() == CV_8UC3);
  const std::unique_ptr<void, int (*)(tjhandle)> compressor(tjInitCompress(), tjDestroy);
  unsigned char* data = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int): turbojpeg's own type
  const int result =
      tjCompress2(compressor.get(), image.data, image.cols, static_cast<int>(image.step),
                  image.rows, TJPF_BGR, &data, &size, TJSAMP_420, quality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(data, tjFree);
  if (result != 0)
    throw std::runtime_error(std::string("turbojpeg: ") + tjGetErrorStr2(compressor.get()));
  return {data, data + size};
}

std::vector<std::uint8_t> EncodeJpegWithin(const cv::Mat& image, int quality,
                                           std::size_t max_bytes) {
  constexpr int kStep = 8;
  constexpr int kLowest = 40;
  std::vector<std::uint8_t> jpeg = EncodeJpeg(image, quality);
  while (jpeg.size() > max_bytes && quality - kStep >= kLowest) {
    quality -= kStep;
    jpeg = EncodeJpeg(image, quality);
  }
  return jpeg;
}

}  // namespace beckon::simulation
