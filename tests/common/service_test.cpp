#include "common/service.hpp"

#include <gmock/gmock.h>

#include <csignal>
#include <thread>

#include "beckon/call_t.hpp"
#include "beckon/rssi_reading_t.hpp"
#include "beckon/service_health_t.hpp"
#include "common/channels.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using std::chrono::seconds;
using testing::DispatchUntil;
using ::testing::HasSubstr;

class ServiceTest : public ::testing::Test {
 protected:
  std::filesystem::path Config(const std::string& text) {
    return directory_.Write("robot.toml", text);
  }
  testing::Finished RunEcho(const std::vector<std::string>& arguments) {
    return testing::RunToEnd(ECHO_SERVICE, arguments);
  }
  testing::TempDir directory_;
};

TEST_F(ServiceTest, HelpAndCommandLineErrors) {
  const auto help = RunEcho({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.output, HasSubstr("--print-config"));
  EXPECT_EQ(RunEcho({}).exit_code, 2) << "no --config";
  EXPECT_EQ(RunEcho({"--config", "x.toml", "--nonsense"}).exit_code, 2);
}

TEST_F(ServiceTest, BadConfigurationIsExitCode2WithThePlace) {
  const auto path = Config("[navigator]\ngian = 2.0\n");
  const auto finished = RunEcho({"--config", path});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_THAT(finished.output,
              HasSubstr(path.string() + ":2: navigator.gian: unknown key; did you mean 'gain'?"));
  EXPECT_EQ(RunEcho({"--config", "/nonexistent.toml"}).exit_code, 2);
  EXPECT_EQ(RunEcho({"--config", Config("[navigator]\ngain = 'x'\n")}).exit_code, 2);
}

TEST_F(ServiceTest, PrintsTheConfigurationThatHolds) {
  const auto finished = RunEcho({"--config", Config("[lcm]\nurl = 'memq://'\n"), "--print-config"});
  EXPECT_EQ(finished.exit_code, 0);
  EXPECT_THAT(finished.output, HasSubstr("url = 'memq://'"));
  EXPECT_THAT(finished.output, HasSubstr("gain = 1.0"));
}

class RunningServiceTest : public ServiceTest {
 protected:
  RunningServiceTest()
      : bus_(kDefaultLcmUrl), calls_(bus_, channels::kCall), health_(bus_, channels::kHealth) {}

  testing::Process Start(const std::string& config) {
    return {ECHO_SERVICE, {"--config", Config(config)}};
  }

  void Send(const std::string& tag, std::int64_t utime) {
    rssi_reading_t reading{};
    reading.utime = utime;
    reading.tag = tag;
    bus_.Publish(channels::kRssi, reading);
  }
  bool WaitForAnswer(std::int64_t utime) {
    return DispatchUntil(
        bus_, [&] { return calls_.size() > 0 && calls_.messages().back().utime == utime; });
  }
  bool WaitForHealth() {
    const auto before = health_.size();
    return DispatchUntil(bus_, [&] { return health_.size() > before; });
  }

  MessageBus bus_;
  testing::Collector<call_t> calls_;
  testing::Collector<service_health_t> health_;
};

TEST_F(RunningServiceTest, AnswersReportsHealthAndEndsCleanly) {
  testing::Process service = Start("");
  ASSERT_TRUE(WaitForHealth());
  EXPECT_EQ(health_.messages()[0].service, "echo_service");
  EXPECT_EQ(health_.messages()[0].pid, service.pid());
  EXPECT_EQ(health_.messages()[0].state, service_health_t::WAITING);
  Send("tag", 7);
  ASSERT_TRUE(WaitForAnswer(7));
  ASSERT_TRUE(
      DispatchUntil(bus_, [&] { return health_.messages().back().state == service_health_t::OK; }));
  EXPECT_EQ(health_.messages().back().received, 1);

  service.Signal(SIGTERM);
  EXPECT_EQ(service.WaitForExit(), 0);
  EXPECT_TRUE(WaitForAnswer(-1)) << "what it promised to say at the end";
}

TEST_F(RunningServiceTest, GoodCorruptGoodAgain) {
  testing::Process service = Start("");
  ASSERT_TRUE(WaitForHealth());
  Send("tag", 1);
  ASSERT_TRUE(WaitForAnswer(1));
  // A reading whose text claims to be 2^31 - 1 bytes long.
  rssi_reading_t reading{};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(reading.getEncodedSize()));
  reading.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  bytes[16] = 0x7F;
  bytes[17] = bytes[18] = bytes[19] = 0xFF;
  testing::PublishRaw(channels::kRssi, bytes);
  bytes[16] = 0xFF;  // and -1 bytes
  testing::PublishRaw(channels::kRssi, bytes);
  testing::PublishRaw(channels::kRssi, {0xDE, 0xAD});
  Send("throw", 2);
  Send("tag", 3);
  ASSERT_TRUE(WaitForAnswer(3));
  ASSERT_TRUE(DispatchUntil(bus_, [&] { return health_.messages().back().refused == 4; }))
      << "refused: " << health_.messages().back().refused;
  EXPECT_TRUE(service.IsRunning());
}

TEST_F(RunningServiceTest, AHungLoopEndsTheProcess) {
  testing::Process service = Start("[runtime]\nwatchdog_s = 1.0\n");
  ASSERT_TRUE(WaitForHealth());
  Send("hang", 1);
  EXPECT_EQ(service.WaitForExit(), 70);
  EXPECT_THAT(service.Output(), HasSubstr("has not turned"));
}

TEST_F(RunningServiceTest, ASuspendedProcessIsNotAHungOne) {
  testing::Process service = Start("[runtime]\nwatchdog_s = 1.0\n");
  ASSERT_TRUE(WaitForHealth());
  service.Signal(SIGSTOP);
  std::this_thread::sleep_for(seconds(2));
  service.Signal(SIGCONT);
  Send("tag", 5);
  EXPECT_TRUE(WaitForAnswer(5));
  EXPECT_TRUE(service.IsRunning());
}

TEST_F(ServiceTest, WithoutANetworkItWaitsAndSaysWhy) {
  testing::Process service(ECHO_SERVICE,
                           {"--config", Config(""), "--lcm-url", "udpm://192.0.2.1:7667"});
  EXPECT_TRUE(service.WaitForOutput("multicast route"));
  EXPECT_TRUE(service.IsRunning());
  service.Signal(SIGTERM);
  EXPECT_EQ(service.WaitForExit(), 0);
}

}  // namespace
}  // namespace beckon
