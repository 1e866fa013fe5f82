#include "common/jpeg.hpp"

#include <turbojpeg.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace beckon {
namespace {

using Handle = std::unique_ptr<void, int (*)(tjhandle)>;

}  // namespace

std::vector<std::uint8_t> EncodeJpeg(const cv::Mat& image, int quality) {
  if (image.type() != CV_8UC3 || image.empty()) throw std::invalid_argument("not a BGR picture");
  const Handle compressor(tjInitCompress(), tjDestroy);
  unsigned char* data = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int): turbojpeg's own type
  const int result =
      tjCompress2(compressor.get(), image.data, image.cols, static_cast<int>(image.step),
                  image.rows, TJPF_BGR, &data, &size, TJSAMP_420, quality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(data, tjFree);
  if (result != 0) throw std::runtime_error(tjGetErrorStr2(compressor.get()));
  return {data, data + size};
}

cv::Size InspectJpeg(std::span<const std::uint8_t> jpeg) {
  while (!jpeg.empty() && (jpeg.back() == 0 || jpeg.back() == '\r' || jpeg.back() == '\n')) {
    jpeg = jpeg.first(jpeg.size() - 1);
  }
  const std::size_t size = jpeg.size();
  if (size < 4 || jpeg[0] != 0xff || jpeg[1] != 0xd8) {
    throw std::invalid_argument("does not begin like a JPEG file");
  }
  if (jpeg[size - 2] != 0xff || jpeg[size - 1] != 0xd9) {
    throw std::invalid_argument("is a JPEG file cut short after " + std::to_string(size) +
                                " bytes");
  }
  const Handle decompressor(tjInitDecompress(), tjDestroy);
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colour_space = 0;
  if (tjDecompressHeader3(decompressor.get(), jpeg.data(), jpeg.size(), &width, &height,
                          &subsampling, &colour_space) != 0) {
    throw std::invalid_argument(std::string("is a damaged JPEG file: ") +
                                tjGetErrorStr2(decompressor.get()));
  }
  return {width, height};
}

}  // namespace beckon
