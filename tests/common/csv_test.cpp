#include "common/csv.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/support.hpp"

namespace beckon {
namespace {

using ::testing::HasSubstr;

class CsvTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& text) {
    return directory_.Write("data.csv", text);
  }
  template <typename Action>
  std::string ErrorOf(Action action) {
    try {
      action();
    } catch (const FileError& error) {
      return error.what();
    }
    return "no error";
  }
  testing::TempDir directory_;
};

TEST_F(CsvTest, ReadsRowsWithUnixAndDosLineEnds) {
  CsvReader csv(Write("utime,tag,range\r\n12,a,1.5\r\n\r\n-3,b,inf\n"), {"utime", "tag", "range"});
  ASSERT_TRUE(csv.Next());
  EXPECT_EQ(csv.Integer(0), 12);
  EXPECT_EQ(csv.Text(1), "a");
  EXPECT_EQ(csv.Number(2), 1.5);
  ASSERT_TRUE(csv.Next());
  EXPECT_EQ(csv.line(), 4);
  EXPECT_EQ(csv.Integer(0), -3);
  EXPECT_TRUE(std::isinf(csv.Number(2, true)));
  EXPECT_FALSE(csv.Next());
}

TEST_F(CsvTest, ErrorsNameFileLineAndColumn) {
  const auto path = Write("utime,range\n1,2\n3\n");
  CsvReader csv(path, {"utime", "range"});
  ASSERT_TRUE(csv.Next());
  EXPECT_EQ(ErrorOf([&] { csv.Next(); }), path.string() + ":3: has 1 fields, expected 2");

  CsvReader bad(Write("utime,range\n1.5,inf\n"), {"utime", "range"});
  ASSERT_TRUE(bad.Next());
  EXPECT_THAT(ErrorOf([&] { bad.Integer(0); }),
              HasSubstr(":2: 'utime' has to be a whole number, it is '1.5'"));
  EXPECT_THAT(ErrorOf([&] { bad.Number(1); }),
              HasSubstr(":2: 'range' has to be a number, it is 'inf'"));
}

TEST_F(CsvTest, NotANumberIsRefused) {
  CsvReader csv(Write("x\nnan\n"), {"x"});
  ASSERT_TRUE(csv.Next());
  EXPECT_THAT(ErrorOf([&] { csv.Number(0); }), HasSubstr("has to be a number"));
}

TEST_F(CsvTest, HeaderHasToFit) {
  EXPECT_THAT(ErrorOf([&] {
                CsvReader(Write("a,b\n"), {"a", "c"});
              }),
              HasSubstr(":1: the first line has to be 'a,c', it is 'a,b'"));
  EXPECT_THAT(ErrorOf([&] { CsvReader(directory_.path() / "none.csv", {"a"}); }),
              HasSubstr("cannot be opened"));
}

}  // namespace
}  // namespace beckon
