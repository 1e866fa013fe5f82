#include "common/config.hpp"

#include <gmock/gmock.h>

#include "tests/support/support.hpp"

namespace beckon {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ConfigTest : public ::testing::Test {
 protected:
  // What a service with these keys would say of the file; empty when it is content.
  std::string ErrorOf(const std::string& text) {
    const auto path = directory_.Write("robot.toml", text);
    try {
      ConfigFile file(path);
      file.IgnoreOtherPrograms();
      ConfigTable& table = file.Table("range_caster");
      table.Optional("enabled", enabled_);
      table.Optional("rays", rays_, Range{1, 1000});
      table.Required("max_range_m", max_range_m_, AtLeast(0.1));
      table.Optional("origin", origin_, 2);
      table.OptionalChoice("mode", mode_, {"fast", "exact"});
      table.OptionalPath("map", map_);
      file.Finish();
      effective_ = file.Effective();
      return "";
    } catch (const ConfigError& error) {
      const std::string what = error.what();
      EXPECT_THAT(what, StartsWith(path.string() + ":")) << "every error names the file";
      return what.substr(path.string().size());
    }
  }

  testing::TempDir directory_;
  bool enabled_ = false;
  int rays_ = 180;
  double max_range_m_ = 0.0;
  std::vector<double> origin_ = {0.0, 0.0};
  std::string mode_ = "exact";
  std::filesystem::path map_;
  std::string effective_;
};

TEST_F(ConfigTest, ReadsEveryTypeAndKeepsDefaults) {
  EXPECT_EQ(
      ErrorOf(
          "[range_caster]\nenabled = true\nmax_range_m = 6\norigin = [1, 2.5]\nmap = 'a/b.png'\n"),
      "");
  EXPECT_TRUE(enabled_);
  EXPECT_EQ(rays_, 180);
  EXPECT_EQ(max_range_m_, 6.0);
  EXPECT_EQ(origin_, (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(map_, directory_.path() / "a/b.png") << "relative paths start at the file";
}

TEST_F(ConfigTest, UnknownKeyIsNamedWithLineAndNearestName) {
  EXPECT_EQ(ErrorOf("[range_caster]\nmax_range_m = 6.0\n\nray = 3\n"),
            ":4: range_caster.ray: unknown key; did you mean 'rays'?");
}

TEST_F(ConfigTest, UnknownTableIsNamed) {
  EXPECT_THAT(ErrorOf("[range_caster]\nmax_range_m = 6.0\n[range_castor]\n"),
              HasSubstr(":3: range_castor: unknown key; did you mean 'range_caster'?"));
}

TEST_F(ConfigTest, TablesOfOthersAreLeftAlone) {
  EXPECT_EQ(ErrorOf("[range_caster]\nmax_range_m = 6.0\n[navigator]\nanything = 1\n"), "");
}

TEST_F(ConfigTest, WrongTypesAreNamed) {
  EXPECT_EQ(ErrorOf("[range_caster]\nmax_range_m = 'far'\n"),
            ":2: range_caster.max_range_m: has to be a number, it is a string");
  EXPECT_THAT(ErrorOf("[range_caster]\nmax_range_m = 1\nrays = 2.5\n"),
              EndsWith(":3: range_caster.rays: has to be a whole number, it is a floating-point"));
  EXPECT_THAT(ErrorOf("[range_caster]\nmax_range_m = 1\nenabled = 1\n"),
              HasSubstr("has to be true or false"));
  EXPECT_THAT(ErrorOf("[range_caster]\nmax_range_m = 1\norigin = [1]\n"),
              HasSubstr("a list of 2 numbers, it has 1"));
  EXPECT_THAT(ErrorOf("range_caster = 5\n"), HasSubstr(":1: range_caster: has to be a table"));
}

TEST_F(ConfigTest, LimitsHold) {
  EXPECT_EQ(ErrorOf("[range_caster]\nmax_range_m = 0.05\n"),
            ":2: range_caster.max_range_m: has to be at least 0.1, it is 0.05");
  EXPECT_THAT(ErrorOf("[range_caster]\nmax_range_m = nan\n"), HasSubstr("has to be finite"));
  EXPECT_THAT(ErrorOf("[range_caster]\nmax_range_m = 1\nrays = 9999999999\n"),
              HasSubstr("between 1 and 1000"));
  EXPECT_THAT(ErrorOf("[range_caster]\nmax_range_m = 1\nmode = 'slow'\n"),
              HasSubstr("has to be one of 'fast', 'exact'; it is 'slow'"));
}

TEST_F(ConfigTest, MissingKeyPointsAtItsTable) {
  EXPECT_EQ(ErrorOf("\n[range_caster]\nrays = 3\n"), ":2: range_caster.max_range_m: is missing");
}

TEST_F(ConfigTest, SyntaxErrorsHaveALine) {
  EXPECT_THAT(ErrorOf("[range_caster]\nmax_range_m = \n"), StartsWith(":2: "));
  EXPECT_THAT(ErrorOf("[range_caster]\nrays = 1\nrays = 2\n"), StartsWith(":3: "));
}

TEST_F(ConfigTest, MissingFile) {
  EXPECT_THROW(ConfigFile(directory_.path() / "none.toml"), ConfigError);
  EXPECT_THROW(ConfigFile(directory_.path()), ConfigError);
}

TEST_F(ConfigTest, EffectiveConfigurationReadsBackAsItself) {
  ASSERT_EQ(ErrorOf("[range_caster]\nmax_range_m = 6.1\n"), "");
  const std::string first = effective_;
  EXPECT_THAT(first, HasSubstr("rays = 180\n"));
  EXPECT_THAT(first, HasSubstr("max_range_m = 6.1\n"));
  EXPECT_THAT(first, HasSubstr("origin = [0.0, 0.0]\n"));
  map_.clear();
  rays_ = 1;
  mode_ = "fast";
  // An empty path is not a path, so the line that shows an unset one is left out.
  std::string again = first;
  const auto map_line = again.find("map = ");
  again.erase(map_line, again.find('\n', map_line) - map_line + 1);
  ASSERT_EQ(ErrorOf(again), "");
  EXPECT_EQ(effective_, first);
}

}  // namespace
}  // namespace beckon
