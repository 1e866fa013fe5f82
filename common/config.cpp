#include "common/config.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <utility>

namespace beckon {
namespace {

// All tables of a robot's file.
const std::set<std::string> kRobotFileTables = {
    "lcm",           "runtime",        "site",           "camera",          "robot",
    "beacon_reader", "rssi_localizer", "camera_grabber", "ground_detector", "range_caster",
    "navigator",     "simulate_robot", "base_adapter"};

std::string Where(const std::filesystem::path& file, const toml::node* node) {
  const auto line = node != nullptr ? node->source().begin.line : 0;
  return file.string() + ":" + (line > 0 ? std::to_string(line) + ":" : "") + " ";
}

std::string TypeName(const toml::node& node) {
  std::ostringstream out;
  out << node.type();
  return out.str();
}

// Levenshtein distance, for "did you mean".
std::size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, replaced}));
    }
  }
  return row[b.size()];
}

std::string Suggestion(const std::string& key, const std::set<std::string>& known) {
  const auto nearest = std::min_element(
      known.begin(), known.end(),
      [&](const auto& a, const auto& b) { return EditDistance(key, a) < EditDistance(key, b); });
  if (nearest == known.end() ||
      EditDistance(key, *nearest) > std::max<std::size_t>(2, key.size() / 3))
    return "";
  return "; did you mean '" + *nearest + "'?";
}

template <typename T>
std::string AsToml(const T& value) {
  std::ostringstream out;
  out << toml::value<T>(value);
  return out.str();
}

// The shortest text that reads back as the same number.
template <>
std::string AsToml<double>(const double& value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  std::string text(buffer.data(), end);
  if (text.find_first_of(".en") == std::string::npos)
    text += ".0";  // or it would be a whole number
  return text;
}

std::string LimitsText(const Range& range) {
  std::ostringstream out;
  if (std::isinf(range.max)) {
    out << "at least " << range.min;
  } else if (std::isinf(range.min)) {
    out << "at most " << range.max;
  } else {
    out << "between " << range.min << " and " << range.max;
  }
  return out.str();
}

}  // namespace

struct ConfigTable::Impl {
  std::filesystem::path file;
  std::shared_ptr<const toml::table> document;  // keeps `table` alive
  const toml::table* table = nullptr;           // null: not given
  std::string name;                             // dotted, empty at the top
  std::set<std::string> known;
  std::set<std::string> ignored;
  std::vector<std::pair<std::string, std::string>> effective;  // key, value as TOML
  std::vector<std::pair<std::string, std::unique_ptr<ConfigTable>>> children;
  std::vector<std::pair<std::string, std::unique_ptr<ConfigTable>>> array_children;

  std::string Dotted(const std::string& key) const { return name.empty() ? key : name + "." + key; }

  const toml::node* Find(const std::string& key) {
    known.insert(key);
    return table != nullptr ? table->get(key) : nullptr;
  }

  void Record(const std::string& key, const std::string& value) {
    const auto entry = std::find_if(effective.begin(), effective.end(),
                                    [&](const auto& pair) { return pair.first == key; });
    if (entry == effective.end()) {
      effective.emplace_back(key, value);
    } else {
      entry->second = value;
    }
  }

  [[noreturn]] void Fail(const toml::node* node, const std::string& key,
                         const std::string& what) const {
    throw ConfigError(Where(file, node != nullptr ? node : table) + Dotted(key) + ": " + what);
  }

  template <typename T>
  T As(const toml::node& node, const std::string& key, const char* expected) const {
    const auto value = node.value_exact<T>();
    if (!value)
      Fail(&node, key, std::string("has to be ") + expected + ", it is a " + TypeName(node));
    return *value;
  }

  // A whole number is a number, too.
  double AsNumber(const toml::node& node, const std::string& key) const {
    const auto value = node.value<double>();
    if (!node.is_number() || !value)
      Fail(&node, key, "has to be a number, it is a " + TypeName(node));
    if (!std::isfinite(*value)) Fail(&node, key, "has to be finite");
    return *value;
  }

  const toml::array& AsArray(const toml::node& node, const std::string& key) const {
    const toml::array* array = node.as_array();
    if (array == nullptr) Fail(&node, key, "has to be a list, it is a " + TypeName(node));
    return *array;
  }

  std::vector<double> AsNumbers(const toml::node& node, const std::string& key,
                                std::size_t size) const {
    std::vector<double> numbers;
    for (const toml::node& element : AsArray(node, key)) numbers.push_back(AsNumber(element, key));
    if (numbers.size() != size) {
      Fail(&node, key,
           "has to be a list of " + std::to_string(size) + " numbers, it has " +
               std::to_string(numbers.size()));
    }
    return numbers;
  }

  std::vector<Eigen::Vector2d> AsPoints(const toml::node& node, const std::string& key) const {
    std::vector<Eigen::Vector2d> points;
    for (const toml::node& element : AsArray(node, key)) {
      const auto xy = AsNumbers(element, key, 2);
      points.emplace_back(xy[0], xy[1]);
    }
    return points;
  }

  void CheckRange(const toml::node& node, const std::string& key, double value,
                  const Range& range) const {
    if (value >= range.min && value <= range.max) return;
    std::ostringstream text;
    text << "has to be " << LimitsText(range) << ", it is " << value;
    Fail(&node, key, text.str());
  }

  std::unique_ptr<ConfigTable> Child(const toml::table* child, const std::string& key) const {
    auto impl = std::make_unique<Impl>();
    impl->file = file;
    impl->document = document;
    impl->table = child;
    impl->name = Dotted(key);
    return std::unique_ptr<ConfigTable>(new ConfigTable(std::move(impl)));
  }

  void Print(std::ostream& out) const {
    if (!name.empty() && !effective.empty()) out << "\n[" << name << "]\n";
    for (const auto& [key, value] : effective) out << key << " = " << value << "\n";
    for (const auto& [key, child] : children) child->impl_->Print(out);
  }
};

ConfigTable::ConfigTable(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ConfigTable::~ConfigTable() = default;

void ConfigTable::Optional(const std::string& key, bool& value) {
  if (const auto* node = impl_->Find(key)) value = impl_->As<bool>(*node, key, "true or false");
  impl_->Record(key, value ? "true" : "false");
}

void ConfigTable::Optional(const std::string& key, int& value, Range range) {
  if (const auto* node = impl_->Find(key)) {
    const auto number = impl_->As<std::int64_t>(*node, key, "a whole number");
    range.min = std::max(range.min, static_cast<double>(std::numeric_limits<int>::min()));
    range.max = std::min(range.max, static_cast<double>(std::numeric_limits<int>::max()));
    impl_->CheckRange(*node, key, static_cast<double>(number), range);
    value = static_cast<int>(number);
  }
  impl_->Record(key, std::to_string(value));
}

void ConfigTable::Optional(const std::string& key, double& value, Range range) {
  if (const auto* node = impl_->Find(key)) {
    const double number = impl_->AsNumber(*node, key);
    impl_->CheckRange(*node, key, number, range);
    value = number;
  }
  impl_->Record(key, AsToml(value));
}

void ConfigTable::Optional(const std::string& key, std::string& value) {
  if (const auto* node = impl_->Find(key)) value = impl_->As<std::string>(*node, key, "a text");
  impl_->Record(key, AsToml(value));
}

void ConfigTable::Optional(const std::string& key, std::vector<double>& value, std::size_t size) {
  if (const auto* node = impl_->Find(key)) value = impl_->AsNumbers(*node, key, size);
  std::string text;
  for (const double number : value) text += (text.empty() ? "" : ", ") + AsToml(number);
  impl_->Record(key, "[" + text + "]");
}

void ConfigTable::Optional(const std::string& key, std::vector<std::string>& value) {
  if (const auto* node = impl_->Find(key)) {
    value.clear();
    for (const toml::node& element : impl_->AsArray(*node, key)) {
      value.push_back(impl_->As<std::string>(element, key, "a list of texts"));
    }
  }
  std::string text;
  for (const auto& element : value) text += (text.empty() ? "" : ", ") + AsToml(element);
  impl_->Record(key, "[" + text + "]");
}

void ConfigTable::OptionalChoice(const std::string& key, std::string& value,
                                 const std::vector<std::string>& names) {
  std::string chosen = value;
  Optional(key, chosen);
  if (std::find(names.begin(), names.end(), chosen) == names.end()) {
    std::string list;
    for (const auto& name : names) list += (list.empty() ? "'" : ", '") + name + "'";
    Fail(key, "has to be one of " + list + "; it is '" + chosen + "'");
  }
  value = chosen;
}

void ConfigTable::OptionalPath(const std::string& key, std::filesystem::path& value) {
  if (const auto* node = impl_->Find(key)) {
    const auto text = impl_->As<std::string>(*node, key, "a path");
    if (text.empty()) Fail(key, "is an empty path");
    value = (impl_->file.parent_path() / text).lexically_normal();
  }
  impl_->Record(key, AsToml(value.string()));
}

bool ConfigTable::Has(const std::string& key) const { return impl_->Find(key) != nullptr; }

void ConfigTable::Demand(const std::string& key) const {
  if (!Has(key)) Fail(key, "is missing");
}

void ConfigTable::Required(const std::string& key, Eigen::Vector2d& value) {
  std::vector<double> numbers;
  Required(key, numbers, std::size_t{2});
  value = {numbers[0], numbers[1]};
}

void ConfigTable::Required(const std::string& key, Eigen::Vector3d& value) {
  std::vector<double> numbers;
  Required(key, numbers, std::size_t{3});
  value = {numbers[0], numbers[1], numbers[2]};
}

std::vector<Eigen::Vector2d> ConfigTable::Points(const std::string& key) {
  const auto* node = impl_->Find(key);
  return node != nullptr ? impl_->AsPoints(*node, key) : std::vector<Eigen::Vector2d>{};
}

std::vector<std::vector<Eigen::Vector2d>> ConfigTable::PointLists(const std::string& key) {
  std::vector<std::vector<Eigen::Vector2d>> lists;
  if (const auto* node = impl_->Find(key)) {
    for (const toml::node& element : impl_->AsArray(*node, key))
      lists.push_back(impl_->AsPoints(element, key));
  }
  return lists;
}

std::vector<ConfigTable*> ConfigTable::Tables(const std::string& key) {
  std::vector<ConfigTable*> tables;
  if (const auto* node = impl_->Find(key)) {
    for (const toml::node& element : impl_->AsArray(*node, key)) {
      const toml::table* table = element.as_table();
      if (table == nullptr)
        impl_->Fail(&element, key, "has to be a list of tables, [[" + key + "]]");
      impl_->array_children.emplace_back(key, impl_->Child(table, key));
      tables.push_back(impl_->array_children.back().second.get());
    }
  }
  return tables;
}

ConfigTable& ConfigTable::Table(const std::string& key) {
  for (const auto& [name, child] : impl_->children) {
    if (name == key) return *child;
  }
  const auto* node = impl_->Find(key);
  const toml::table* table = nullptr;
  if (node != nullptr) {
    table = node->as_table();
    if (table == nullptr) impl_->Fail(node, key, "has to be a table, [" + key + "]");
  }
  impl_->children.emplace_back(key, impl_->Child(table, key));
  return *impl_->children.back().second;
}

void ConfigTable::Fail(const std::string& key, const std::string& what) const {
  impl_->Fail(impl_->Find(key), key, what);
}

void ConfigTable::CheckAllKnown() const {
  if (impl_->table != nullptr) {
    for (const auto& [key, node] : *impl_->table) {
      const std::string name(key.str());
      if (impl_->known.contains(name) || impl_->ignored.contains(name)) continue;
      std::set<std::string> names = impl_->known;
      names.insert(impl_->ignored.begin(), impl_->ignored.end());
      impl_->Fail(&node, name, "unknown key" + Suggestion(name, names));
    }
  }
  for (const auto& [key, child] : impl_->children) child->CheckAllKnown();
  for (const auto& [key, child] : impl_->array_children) child->CheckAllKnown();
}

ConfigFile::ConfigFile(const std::filesystem::path& path) : path_(path) {
  if (!std::filesystem::is_regular_file(path)) throw ConfigError(path.string() + ": no such file");
  auto impl = std::make_unique<ConfigTable::Impl>();
  impl->file = path;
  try {
    impl->document = std::make_shared<const toml::table>(toml::parse_file(path.string()));
  } catch (const toml::parse_error& error) {
    throw ConfigError(path.string() + ":" + std::to_string(error.source().begin.line) + ": " +
                      std::string(error.description()));
  }
  impl->table = impl->document.get();
  root_ = std::unique_ptr<ConfigTable>(new ConfigTable(std::move(impl)));
}

ConfigFile::~ConfigFile() = default;

void ConfigFile::IgnoreOtherPrograms() { root_->impl_->ignored = kRobotFileTables; }

void ConfigFile::Finish() const { root_->CheckAllKnown(); }

std::string ConfigFile::Effective() const {
  std::ostringstream out;
  root_->impl_->Print(out);
  return out.str();
}

}  // namespace beckon
