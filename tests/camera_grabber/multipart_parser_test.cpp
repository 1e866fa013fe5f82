#include "services/camera_grabber/multipart_parser.hpp"

#include <gmock/gmock.h>

#include <random>

#include "tests/camera_grabber/test_frames.hpp"

namespace beckon {
namespace {

using ::testing::ElementsAre;
using testing::Part;

std::vector<std::string> Bodies(const std::vector<MultipartParser::Part>& parts) {
  std::vector<std::string> bodies;
  for (const auto& part : parts) bodies.emplace_back(part.body.begin(), part.body.end());
  return bodies;
}

std::vector<std::string> ParseInOne(const std::string& stream) {
  MultipartParser parser("frame");
  return Bodies(parser.Feed(stream));
}

TEST(MultipartParser, FindsTheBoundaryInTheContentType) {
  EXPECT_EQ(MultipartParser::BoundaryOf("multipart/x-mixed-replace; boundary=frame"), "frame");
  EXPECT_EQ(MultipartParser::BoundaryOf("Multipart/X-Mixed-Replace;boundary=\"--my\"; x=y"),
            "--my");
  EXPECT_EQ(MultipartParser::BoundaryOf("text/html"), "");
  EXPECT_EQ(MultipartParser::BoundaryOf("multipart/x-mixed-replace"), "");
}

TEST(MultipartParser, SplitsTheSameWhereverTheStreamIsCut) {
  const std::string stream =
      Part("one", "X-Timestamp: 12.5\r\n") + Part("two\r\n-- not a boundary") + Part("three");
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    MultipartParser parser("frame");
    auto parts = parser.Feed(std::string_view(stream).substr(0, cut));
    for (auto& part : parser.Feed(std::string_view(stream).substr(cut)))
      parts.push_back(std::move(part));
    ASSERT_THAT(Bodies(parts), ElementsAre("one", "two\r\n-- not a boundary", "three")) << cut;
    ASSERT_EQ(parts[0].headers.at("x-timestamp"), "12.5");
    ASSERT_EQ(parser.malformed(), 0);
  }
}

TEST(MultipartParser, DoesWithoutALengthAndWithDashesInTheBoundary) {
  const std::string stream =
      "--frame\nContent-Type: image/jpeg\n\none\n--frame\r\n\r\ntwo\r\n--frame\r\n";
  EXPECT_THAT(ParseInOne(stream), ElementsAre("one", "two"));
  MultipartParser dashed("--frame");
  EXPECT_THAT(Bodies(dashed.Feed(stream)), ElementsAre("one", "two"));
}

TEST(MultipartParser, PassesOverGarbageBetweenParts) {
  EXPECT_THAT(
      ParseInOne("\xff\xd8junk--fra\r\n" + Part("one") + "more junk -- junk\n\n" + Part("two")),
      ElementsAre("one", "two"));
}

TEST(MultipartParser, APartCutShortCostsOnlyItself) {
  std::string cut = Part("a body that is cut");
  cut.resize(cut.size() - 10);
  MultipartParser parser("frame");
  EXPECT_THAT(Bodies(parser.Feed(cut + "\r\n" + Part("two") + Part("three"))),
              ElementsAre("two", "three"));
  EXPECT_EQ(parser.malformed(), 1);
}

TEST(MultipartParser, GivesUpHeadersThatAreNone) {
  MultipartParser parser("frame");
  EXPECT_THAT(Bodies(parser.Feed("--frame\r\nno colon here\r\n\r\n" + Part("one"))),
              ElementsAre("one"));
  EXPECT_THAT(Bodies(parser.Feed("--frame\r\nContent-Length: many\r\n\r\n" + Part("two"))),
              ElementsAre("two"));
  EXPECT_THAT(Bodies(parser.Feed("--frame\r\nContent-Length: 99999999999\r\n\r\n" + Part("three"))),
              ElementsAre("three"));
  EXPECT_THAT(
      Bodies(parser.Feed("--frame\r\nX: " + std::string(20000, 'x') + "\r\n\r\n" + Part("four"))),
      ElementsAre("four"));
  EXPECT_EQ(parser.malformed(), 4);
}

TEST(MultipartParser, RandomBytesNeverStopIt) {
  std::mt19937 random(1);
  MultipartParser parser("frame");
  const std::string pieces[] = {
      "--frame", "\r\n", "\r\n\r\n", "Content-Length: 5", ":", "x", std::string(3000, 'y')};
  for (int i = 0; i < 20000; ++i) parser.Feed(pieces[random() % std::size(pieces)]);
  // At most one part is swallowed by what came before it.
  parser.Feed("\r\n" + Part("first") + Part("second"));
  EXPECT_THAT(Bodies(parser.Feed(Part("one") + Part("two"))), ElementsAre("one", "two"));
}

}  // namespace
}  // namespace beckon
