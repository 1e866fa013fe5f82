#include "common/csv.hpp"

#include <charconv>
#include <cmath>
#include <limits>

namespace beckon {
namespace {

std::vector<std::string> Split(std::string_view line) {
  std::vector<std::string> fields;
  std::size_t start = 0;
  while (true) {
    const std::size_t comma = line.find(',', start);
    fields.emplace_back(
        line.substr(start, comma == std::string_view::npos ? comma : comma - start));
    if (comma == std::string_view::npos) return fields;
    start = comma + 1;
  }
}

}  // namespace

FileError::FileError(const std::filesystem::path& file, int line, const std::string& what)
    : std::runtime_error(file.string() + ":" + std::to_string(line) + ": " + what) {}

FileError::FileError(const std::filesystem::path& file, const std::string& what)
    : std::runtime_error(file.string() + ": " + what) {}

CsvReader::CsvReader(const std::filesystem::path& file, const std::vector<std::string>& columns)
    : file_(file), stream_(file), columns_(columns) {
  if (!stream_) throw FileError(file, "cannot be opened");
  std::string expected;
  for (const auto& column : columns_) expected += (expected.empty() ? "" : ",") + column;
  std::string header;
  std::getline(stream_, header);
  line_ = 1;
  if (!header.empty() && header.back() == '\r') header.pop_back();
  if (header != expected)
    Fail("the first line has to be '" + expected + "', it is '" + header + "'");
}

bool CsvReader::Next() {
  std::string line;
  while (std::getline(stream_, line)) {
    ++line_;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    fields_ = Split(line);
    if (fields_.size() != columns_.size()) {
      Fail("has " + std::to_string(fields_.size()) + " fields, expected " +
           std::to_string(columns_.size()));
    }
    return true;
  }
  return false;
}

const std::string& CsvReader::Text(std::size_t column) const {
  const std::string& text = fields_.at(column);
  if (text.empty()) Fail("'" + columns_.at(column) + "' is empty");
  return text;
}

std::int64_t CsvReader::Integer(std::size_t column) const {
  const std::string& text = Text(column);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    Fail("'" + columns_.at(column) + "' has to be a whole number, it is '" + text + "'");
  }
  return value;
}

double CsvReader::Number(std::size_t column, bool allow_infinity) const {
  const std::string& text = Text(column);
  if (allow_infinity && text == "inf") return std::numeric_limits<double>::infinity();
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
    Fail("'" + columns_.at(column) + "' has to be a number, it is '" + text + "'");
  }
  return value;
}

void CsvReader::Fail(const std::string& what) const { throw FileError(file_, line_, what); }

}  // namespace beckon
