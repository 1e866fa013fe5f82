// Strict reading of TOML files: every key that is not asked for is an error, and every error names
// file, line and key.
//
//   ConfigFile file("deploy/robots/example.toml");
//   ConfigTable& table = file.Table("navigator");
//   table.Optional("max_speed_mps", options.max_speed_mps, AtLeast(0.05));
//   file.Finish();   // throws if a key was never asked for
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace beckon {

// A configuration that cannot be used. The text starts with "FILE:LINE: TABLE.KEY: ".
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Inclusive limits of a number.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};
inline Range AtLeast(double min) { return {min, std::numeric_limits<double>::infinity()}; }

class ConfigTable {
 public:
  ~ConfigTable();
  ConfigTable(const ConfigTable&) = delete;
  ConfigTable& operator=(const ConfigTable&) = delete;

  // Reads the key into `value`, which keeps its default where the key is not given.
  void Optional(const std::string& key, bool& value);
  void Optional(const std::string& key, int& value, Range range = {});
  void Optional(const std::string& key, double& value, Range range = {});
  void Optional(const std::string& key, std::string& value);
  void Optional(const std::string& key, std::vector<double>& value, std::size_t size);
  void Optional(const std::string& key, std::vector<std::string>& value);
  // One of `names`.
  void OptionalChoice(const std::string& key, std::string& value,
                      const std::vector<std::string>& names);
  // A path; relative ones start from the folder that the file is in.
  void OptionalPath(const std::string& key, std::filesystem::path& value);

  // The same, but it is an error if the key is not there.
  template <typename T, typename... Limits>
  void Required(const std::string& key, T& value, Limits... limits) {
    Demand(key);
    Optional(key, value, limits...);
  }
  void RequiredPath(const std::string& key, std::filesystem::path& value) {
    Demand(key);
    OptionalPath(key, value);
  }

  bool Has(const std::string& key) const;
  void Required(const std::string& key, Eigen::Vector2d& value);
  void Required(const std::string& key, Eigen::Vector3d& value);
  // A list of points [[x, y], ...]; empty where the key is not given.
  std::vector<Eigen::Vector2d> Points(const std::string& key);
  // A list of lists of points; empty where the key is not given.
  std::vector<std::vector<Eigen::Vector2d>> PointLists(const std::string& key);
  // The tables of [[key]]; empty where the key is not given.
  std::vector<ConfigTable*> Tables(const std::string& key);
  // The table [key] in this one; an empty one where it is not given.
  ConfigTable& Table(const std::string& key);

  // Throws a ConfigError that points at this key (or, where it is not there, at the table).
  [[noreturn]] void Fail(const std::string& key, const std::string& what) const;

 private:
  friend class ConfigFile;
  struct Impl;
  explicit ConfigTable(std::unique_ptr<Impl> impl);
  void Demand(const std::string& key) const;
  void CheckAllKnown() const;
  std::unique_ptr<Impl> impl_;
};

class ConfigFile {
 public:
  // Throws ConfigError where the file cannot be read or is not TOML.
  explicit ConfigFile(const std::filesystem::path& path);
  ~ConfigFile();

  const std::filesystem::path& path() const { return path_; }
  ConfigTable& root() { return *root_; }
  ConfigTable& Table(const std::string& key) { return root_->Table(key); }

  // For the file of a robot, which holds a table per program: what the other programs read is not
  // looked into.
  void IgnoreOtherPrograms();

  // Throws ConfigError for the first key that was never asked for, with the nearest known name.
  void Finish() const;

  // What was asked for and the values that hold, defaults included, as TOML.
  std::string Effective() const;

 private:
  std::filesystem::path path_;
  std::unique_ptr<ConfigTable> root_;
};

}  // namespace beckon
