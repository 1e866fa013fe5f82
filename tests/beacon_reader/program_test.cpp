// The running program on a pseudo-terminal, a TCP port, a pipe and a recording.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <pty.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>

#include "beckon/rssi_reading_t.hpp"
#include "beckon/service_health_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "services/beacon_reader/xbee_frames.hpp"
#include "tests/support/process.hpp"
#include "tests/support/support.hpp"

namespace beckon {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::Collector;
using testing::DispatchUntil;
using testing::Process;

// The radio's end of a serial line, reachable by a link that stays while radios come and go.
class Radio {
 public:
  explicit Radio(const std::filesystem::path& link) : link_(link) {
    char name[128];
    termios raw{};
    cfmakeraw(&raw);
    if (openpty(&radio_, &terminal_, name, &raw, nullptr) != 0) throw std::runtime_error("no pty");
    std::filesystem::create_symlink(name, link_);
  }
  ~Radio() {  // unplugged
    std::filesystem::remove(link_);
    close(terminal_);
    close(radio_);
  }
  void Send(const Bytes& bytes) const {
    ASSERT_EQ(write(radio_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  Bytes Receive(std::size_t size) const {
    Bytes bytes(size);
    std::size_t got = 0;
    while (got < size) {
      const ssize_t count = read(radio_, bytes.data() + got, size - got);
      if (count <= 0) break;
      got += static_cast<std::size_t>(count);
    }
    bytes.resize(got);
    return bytes;
  }

 private:
  std::filesystem::path link_;
  int radio_ = -1;
  int terminal_ = -1;
};

Bytes Frame(std::uint8_t beacon, std::uint8_t rssi, const std::string& payload = "") {
  Bytes data = {0x81, 0x00, beacon, rssi, 0x00};
  data.insert(data.end(), payload.begin(), payload.end());
  return XbeeFrame(data, XbeeApiMode::kEscaped);
}

class Program : public ::testing::Test {
 protected:
  void Start(const std::string& toml) {
    const auto config = folder_.Write("robot.toml", toml);
    process_.emplace("beacon_reader", std::vector<std::string>{"--config", config.string()});
  }
  bool WaitForHealth(int state, const std::string& reason) {
    return DispatchUntil(bus_, [&] {
      return !health_.messages().empty() && health_.messages().back().state == state &&
             health_.messages().back().reason.find(reason) != std::string::npos;
    });
  }
  bool WaitForReadings(std::size_t count) {
    return DispatchUntil(bus_, [&] { return readings_.size() >= count; });
  }

  testing::TempDir folder_;
  MessageBus bus_{kDefaultLcmUrl};
  Collector<rssi_reading_t> readings_{bus_, channels::kRssi};
  Collector<service_health_t> health_{bus_, channels::kHealth};
  std::optional<Process> process_;
};

TEST_F(Program, ReadsAnXbeeThatComesGoesAndComesBack) {
  const auto link = folder_.path() / "radio";
  Start("[beacon_reader]\ndevice = \"" + link.string() + "\"\nbaud = 115200\n");
  EXPECT_TRUE(WaitForHealth(service_health_t::FAILED, "No such file"));
  {
    const Radio radio(link);
    EXPECT_TRUE(WaitForHealth(service_health_t::WAITING, "nothing heard yet"));
    // In two pieces, with garbage and a wrong checksum around.
    radio.Send({0x00, 0x13, 0x55});
    Bytes broken = Frame(9, 50);
    broken.back() ^= 1;
    radio.Send(broken);
    const Bytes frame = Frame(1, 0x2c, "caller -71\n");
    radio.Send({frame.begin(), frame.begin() + 6});
    radio.Send({frame.begin() + 6, frame.end()});
    ASSERT_TRUE(WaitForReadings(2));
    EXPECT_EQ(readings_.messages()[0].tag, "robot");
    EXPECT_EQ(readings_.messages()[0].beacon, "0001");
    EXPECT_EQ(readings_.messages()[0].rssi_dbm, -44.0F);
    EXPECT_EQ(readings_.messages()[1].tag, "caller");
    EXPECT_EQ(readings_.messages()[1].rssi_dbm, -71.0F);
    const beckon::Utime now = SystemClock().Now().utime;
    EXPECT_NEAR(static_cast<double>(now - readings_.messages()[1].utime), 0.0, 10e6);
    EXPECT_TRUE(WaitForHealth(service_health_t::OK, ""));
    EXPECT_EQ(health_.messages().back().refused, 1);
    EXPECT_EQ(health_.messages().back().received, 2);
  }
  EXPECT_TRUE(WaitForHealth(service_health_t::FAILED, link.string()));
  readings_.Clear();
  const Radio back(link);
  EXPECT_TRUE(WaitForHealth(service_health_t::WAITING, "nothing heard yet"));
  back.Send(Frame(2, 60));
  ASSERT_TRUE(WaitForReadings(1));
  EXPECT_EQ(readings_.messages()[0].beacon, "0002");
  process_->Signal(SIGTERM);
  EXPECT_EQ(process_->WaitForExit(), 0);
}

TEST_F(Program, AsksMeshFirmwareForThePower) {
  const Radio radio(folder_.path() / "radio");
  Start("[beacon_reader]\ndevice = \"" + (folder_.path() / "radio").string() + "\"\n");
  ASSERT_TRUE(WaitForHealth(service_health_t::WAITING, "nothing heard yet"));
  const Bytes mesh = {0x90, 0, 0x13, 0xa2, 0, 0x40, 0xa1, 0xb2, 0xc3, 0xff, 0xfe, 0x01};
  radio.Send(XbeeFrame(mesh, XbeeApiMode::kEscaped));
  const Bytes question = XbeeFrame(Bytes{0x08, 1, 'D', 'B'}, XbeeApiMode::kEscaped);
  EXPECT_EQ(radio.Receive(question.size()), question);
  radio.Send(XbeeFrame(Bytes{0x88, 1, 'D', 'B', 0, 0x3c}, XbeeApiMode::kEscaped));
  ASSERT_TRUE(WaitForReadings(1));
  EXPECT_EQ(readings_.messages()[0].beacon, "0013A20040A1B2C3");
  EXPECT_EQ(readings_.messages()[0].rssi_dbm, -60.0F);
}

TEST_F(Program, KilledAndRestartedReadsOn) {
  const Radio radio(folder_.path() / "radio");
  const std::string config =
      "[beacon_reader]\ndevice = \"" + (folder_.path() / "radio").string() + "\"\n";
  Start(config);
  ASSERT_TRUE(WaitForHealth(service_health_t::WAITING, "nothing heard yet"));
  process_->Signal(SIGKILL);
  EXPECT_EQ(process_->WaitForExit(), 128 + SIGKILL);
  // What came while nobody listened is old, and half a frame of it is left.
  const Bytes old = Frame(3, 50);
  radio.Send({old.begin(), old.end() - 2});
  health_.Clear();
  Start(config);
  ASSERT_TRUE(WaitForHealth(service_health_t::WAITING, "nothing heard yet"));
  radio.Send(Frame(4, 51));
  ASSERT_TRUE(WaitForReadings(1));
  EXPECT_EQ(readings_.messages()[0].beacon, "0004");
}

// A server on the loopback of this test's own network namespace.
class Server {
 public:
  explicit Server(std::uint16_t port) : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    const int on = 1;
    setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
        listen(listener_, 1) != 0) {
      throw std::runtime_error("cannot listen");
    }
  }
  ~Server() {
    if (client_ >= 0) close(client_);
    close(listener_);
  }
  void Accept() { client_ = accept(listener_, nullptr, nullptr); }
  void Send(const std::string& text) const {
    ASSERT_EQ(send(client_, text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }

 private:
  int listener_ = -1;
  int client_ = -1;
};

TEST_F(Program, ReadsLinesFromATcpServerThatComesGoesAndComesBack) {
  Start("[beacon_reader]\nsource = \"lines\"\ndevice = \"tcp:127.0.0.1:7001\"\n");
  EXPECT_TRUE(WaitForHealth(service_health_t::FAILED, "Connection refused"));
  for (int round = 0; round < 2; ++round) {
    Server server(7001);
    server.Accept();
    readings_.Clear();
    server.Send("kitchen tag7 -6");
    server.Send("3.5\nnonsense\nhall tag7 -70\n");
    ASSERT_TRUE(WaitForReadings(2));
    EXPECT_EQ(readings_.messages()[0].beacon, "kitchen");
    EXPECT_EQ(readings_.messages()[0].rssi_dbm, -63.5F);
    EXPECT_EQ(readings_.messages()[1].beacon, "hall");
  }
  EXPECT_TRUE(WaitForHealth(service_health_t::FAILED, "tcp:127.0.0.1:7001"));
  EXPECT_TRUE(DispatchUntil(bus_, [&] { return health_.messages().back().refused == 2; }));
}

TEST_F(Program, AFloodIsThinnedAndCounted) {
  Start(
      "[beacon_reader]\nsource = \"lines\"\ndevice = \"tcp:127.0.0.1:7002\"\n"
      "max_readings_per_s = 100\n");
  Server server(7002);
  server.Accept();
  std::string flood;
  constexpr int kLines = 20'000;
  for (int i = 0; i < kLines; ++i) flood += "a t -60\n";
  server.Send(flood);
  ASSERT_TRUE(DispatchUntil(bus_, [&] {
    return !health_.messages().empty() &&
           health_.messages().back().received + health_.messages().back().dropped == kLines;
  }));
  EXPECT_GE(health_.messages().back().received, 100);
  EXPECT_LE(health_.messages().back().received, kLines / 10);
}

TEST_F(Program, ReadsANamedPipeWhoseWritersComeAndGo) {
  const auto pipe = folder_.path() / "beacons";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  Start("[beacon_reader]\nsource = \"lines\"\ndevice = \"" + pipe.string() + "\"\n");
  for (std::size_t writer = 1; writer <= 3; ++writer) {
    std::ofstream(pipe) << "kitchen tag7 -63\n";
    EXPECT_TRUE(WaitForReadings(writer));
  }
}

TEST_F(Program, PlaysARecording) {
  folder_.Write("site/site.toml",
                "name = \"s\"\n[area]\nmin = [0.0, 0.0]\nmax = [1.0, 1.0]\n"
                "[[beacons]]\nid = \"a\"\nposition = [0.0, 0.0, 1.0]\n");
  folder_.Write("site/readings.csv",
                "utime,tag,beacon,rssi_dbm\n1000000,t,a,-60\n1200000,t,a,-61\n1400000,t,a,-62\n");
  Start("[site]\nfolder = \"site\"\n[beacon_reader]\nsource = \"playback\"\nloop = true\n");
  ASSERT_TRUE(WaitForReadings(4));
  EXPECT_EQ(readings_.messages()[0].rssi_dbm, -60.0F);
  // The two clocks of an instant are not read at the very same time.
  EXPECT_NEAR(static_cast<double>(readings_.messages()[1].utime - readings_.messages()[0].utime),
              200e3, 20e3);
  EXPECT_EQ(readings_.messages()[3].rssi_dbm, -60.0F) << "from the start again";
}

TEST_F(Program, RefusesABadConfiguration) {
  const auto config = folder_.Write("robot.toml", "[beacon_reader]\ndevise = \"/dev/ttyUSB0\"\n");
  const testing::Finished run = testing::RunToEnd("beacon_reader", {"--config", config.string()});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.output, ::testing::HasSubstr("device"));
}

}  // namespace
}  // namespace beckon
