// Strict reading of the comma-separated files of a site or sequence folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace beckon {

// Something is wrong with a file that a person wrote or recorded. The text starts with "FILE:LINE:
// ".
class FileError : public std::runtime_error {
 public:
  FileError(const std::filesystem::path& file, int line, const std::string& what);
  FileError(const std::filesystem::path& file, const std::string& what);
};

// Reads a file row by row. The first line has to be the given header, column for column.
// All errors are thrown as FileError and name file and line.
class CsvReader {
 public:
  CsvReader(const std::filesystem::path& file, const std::vector<std::string>& columns);

  // Advances to the next row; false at the end of the file. Blank lines are passed over. Throws
  // when a row has another number of fields than the header.
  bool Next();

  const std::string& Text(std::size_t column) const;
  std::int64_t Integer(std::size_t column) const;
  // A finite number, except that "inf" is accepted where `allow_infinity`.
  double Number(std::size_t column, bool allow_infinity = false) const;

  int line() const { return line_; }
  [[noreturn]] void Fail(const std::string& what) const;

 private:
  std::filesystem::path file_;
  std::ifstream stream_;
  std::vector<std::string> columns_;
  std::vector<std::string> fields_;
  int line_ = 0;
};

}  // namespace beckon
