#include "services/beacon_reader/decoder.hpp"

#include <algorithm>
#include <charconv>

#include "common/site.hpp"

namespace beckon {

std::vector<std::string_view> Words(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r";
  std::vector<std::string_view> words;
  for (std::size_t begin = line.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

bool ParseRssi(std::string_view word, double& rssi_dbm) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return false;
  if (!IsPlausibleRssi(value)) return false;
  rssi_dbm = value;
  return true;
}

bool IsId(std::string_view word) {
  constexpr std::size_t kMaxLength = 64;
  return !word.empty() && word.size() <= kMaxLength &&
         std::all_of(word.begin(), word.end(), [](char c) { return c > ' ' && c < 0x7f; });
}

}  // namespace beckon
