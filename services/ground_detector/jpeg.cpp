#include "services/ground_detector/jpeg.hpp"

#include <turbojpeg.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace beckon {

cv::Mat DecodeJpeg(std::span<const std::uint8_t> jpeg, int width, int height) {
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  if (!decoder) throw std::runtime_error("turbojpeg cannot be started");
  const auto refuse = [&] {
    throw std::invalid_argument(std::string("frame refused: ") + tjGetErrorStr2(decoder.get()));
  };

  int found_width = 0;
  int found_height = 0;
  int subsampling = 0;
  int colour_space = 0;
  const auto size = static_cast<unsigned long>(jpeg.size());
  if (tjDecompressHeader3(decoder.get(), jpeg.data(), size, &found_width, &found_height,
                          &subsampling, &colour_space) != 0) {
    refuse();
  }
  if (found_width != width || found_height != height) {
    throw std::invalid_argument("frame refused: " + std::to_string(found_width) + " x " +
                                std::to_string(found_height) +
                                " pixels, but the camera is calibrated for " +
                                std::to_string(width) + " x " + std::to_string(height));
  }
  cv::Mat bgr(height, width, CV_8UC3);
  // A premature end is only a warning to turbojpeg, but it fails all the same, as it is meant to
  // here.
  if (tjDecompress2(decoder.get(), jpeg.data(), size, bgr.data, width, static_cast<int>(bgr.step),
                    height, TJPF_BGR, TJFLAG_STOPONWARNING) != 0) {
    refuse();
  }
  return bgr;
}

}  // namespace beckon
