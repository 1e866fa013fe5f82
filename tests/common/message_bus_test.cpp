#include "common/message_bus.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "beckon/call_t.hpp"
#include "beckon/rssi_reading_t.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using std::chrono::milliseconds;

rssi_reading_t ReadingAt(std::int64_t utime) {
  rssi_reading_t reading{};
  reading.utime = utime;
  reading.tag = "tag";
  reading.beacon = "beacon";
  reading.rssi_dbm = -60.0F;
  return reading;
}

TEST(MessageBus, DeliversEveryMessageInOrder) {
  MessageBus bus(kDefaultLcmUrl);
  testing::Collector<rssi_reading_t> collector(bus, "RSSI");
  for (int i = 0; i < 50; ++i) bus.Publish("RSSI", ReadingAt(i));
  ASSERT_TRUE(testing::DispatchUntil(bus, [&] { return collector.size() == 50; }));
  for (std::size_t i = 0; i < 50; ++i)
    EXPECT_EQ(collector.messages()[i].utime, static_cast<std::int64_t>(i));
  EXPECT_EQ(bus.counts().received, 50);
  EXPECT_EQ(bus.counts().published, 50);
}

TEST(MessageBus, LatestPassesOverWhatIsOld) {
  MessageBus bus(kDefaultLcmUrl);
  std::vector<std::int64_t> seen;
  bus.SubscribeLatest<rssi_reading_t>("RSSI",
                                      [&](const rssi_reading_t& m) { seen.push_back(m.utime); });
  MessageBus sender(kDefaultLcmUrl);
  for (int i = 0; i < 20; ++i) sender.Publish("RSSI", ReadingAt(i));
  // A marker on another channel shows that all before it have arrived.
  ASSERT_TRUE(testing::DispatchUntil(bus, [&] { return !seen.empty() && seen.back() == 19; }));
  EXPECT_LT(seen.size(), 20U);
  EXPECT_EQ(bus.counts().dropped, 20 - static_cast<std::int64_t>(seen.size()));
}

TEST(MessageBus, CorruptMessagesAreCountedAndTheNextGoodOneArrives) {
  MessageBus bus(kDefaultLcmUrl);
  testing::Collector<rssi_reading_t> collector(bus, "RSSI");
  bus.Publish("RSSI", ReadingAt(1));
  testing::PublishRaw("RSSI", {1, 2, 3});
  testing::PublishRaw("RSSI", {});
  bus.Publish("RSSI", call_t{});  // a well-formed message of another type
  bus.Publish("RSSI", ReadingAt(2));
  ASSERT_TRUE(testing::DispatchUntil(bus, [&] { return collector.size() == 2; }));
  EXPECT_EQ(bus.counts().refused, 3);
}

TEST(MessageBus, AHandlerThatThrowsRefusesTheMessageOnly) {
  MessageBus bus(kDefaultLcmUrl);
  int handled = 0;
  bus.Subscribe<rssi_reading_t>("RSSI", [&](const rssi_reading_t& message) {
    if (message.utime < 0) throw std::invalid_argument("before the epoch");
    ++handled;
  });
  bus.Publish("RSSI", ReadingAt(-1));
  bus.Publish("RSSI", ReadingAt(1));
  ASSERT_TRUE(testing::DispatchUntil(bus, [&] { return handled == 1; }));
  EXPECT_EQ(bus.counts().refused, 1);
  EXPECT_EQ(bus.counts().received, 1);
}

TEST(MessageBus, ReadsALogThroughTheSameCodeAndSurvivesItsTruncation) {
  const testing::TempDir directory;
  const std::string log = directory.path() / "x.log";
  {
    MessageBus writer("file://" + log + "?mode=w");
    for (int i = 0; i < 10; ++i) writer.Publish("RSSI", ReadingAt(i));
  }
  const auto count = [&] {
    MessageBus bus("file://" + log + "?speed=0");
    testing::Collector<rssi_reading_t> collector(bus, "RSSI");
    for (int turn = 0; turn < 30; ++turn) bus.Dispatch(milliseconds(1));
    return collector.size();
  };
  EXPECT_EQ(count(), 10U);
  std::filesystem::resize_file(log, std::filesystem::file_size(log) - 7);
  EXPECT_EQ(count(), 9U) << "a log that was cut loses its last event only";
}

TEST(MessageBus, ABadUrlSaysWhatToDo) {
  try {
    MessageBus bus("nonsense://");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("nonsense://"));
  }
}

}  // namespace
}  // namespace beckon
