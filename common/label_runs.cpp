#include "common/label_runs.hpp"

#include <algorithm>
#include <stdexcept>

namespace beckon {
namespace {

constexpr int kMaxSide = 16384;
constexpr unsigned kLabelBits = 2;

void AppendRun(std::vector<std::uint8_t>& runs, std::uint64_t length, std::uint8_t label) {
  std::uint64_t value = (length << kLabelBits) | label;
  while (value >= 0x80) {
    runs.push_back(static_cast<std::uint8_t>(value | 0x80));
    value >>= 7;
  }
  runs.push_back(static_cast<std::uint8_t>(value));
}

}  // namespace

std::vector<std::uint8_t> EncodeLabels(const cv::Mat& labels) {
  if (labels.type() != CV_8UC1 || labels.empty()) {
    throw std::invalid_argument("labels have to be a non-empty 8 bit image of one channel");
  }
  std::vector<std::uint8_t> runs;
  std::uint64_t length = 0;
  std::uint8_t label = labels.at<std::uint8_t>(0, 0);
  for (int v = 0; v < labels.rows; ++v) {
    const auto* row = labels.ptr<std::uint8_t>(v);
    for (int u = 0; u < labels.cols; ++u) {
      if (row[u] >= (1U << kLabelBits)) throw std::invalid_argument("a label is over 3");
      if (row[u] != label) {
        AppendRun(runs, length, label);
        label = row[u];
        length = 0;
      }
      ++length;
    }
  }
  AppendRun(runs, length, label);
  return runs;
}

cv::Mat DecodeLabels(std::span<const std::uint8_t> runs, int width, int height) {
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) {
    throw std::invalid_argument("a label image of " + std::to_string(width) + " x " +
                                std::to_string(height) + " pixels");
  }
  cv::Mat labels(height, width, CV_8UC1);
  std::uint8_t* out = labels.data;
  const std::uint8_t* const end = labels.data + labels.total();
  std::size_t at = 0;
  while (at < runs.size()) {
    std::uint64_t value = 0;
    unsigned shift = 0;
    while (true) {
      if (at == runs.size()) throw std::invalid_argument("label runs are cut short");
      if (shift > 56) throw std::invalid_argument("a label run has an endless length");
      const std::uint8_t byte = runs[at++];
      value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
      shift += 7;
      if ((byte & 0x80) == 0) break;
    }
    const std::uint64_t length = value >> kLabelBits;
    if (length > static_cast<std::uint64_t>(end - out)) {
      throw std::invalid_argument("label runs are longer than the image");
    }
    out = std::fill_n(out, length, static_cast<std::uint8_t>(value & ((1U << kLabelBits) - 1)));
  }
  if (out != end) throw std::invalid_argument("label runs are shorter than the image");
  return labels;
}

}  // namespace beckon
