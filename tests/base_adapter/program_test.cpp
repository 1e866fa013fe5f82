// base_adapter as a program, on a pseudo-terminal in place of the base.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <pty.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cmath>

#include "beckon/service_health_t.hpp"
#include "beckon/velocity_command_t.hpp"
#include "bot_core/pose_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "tests/support/process.hpp"
#include "tools/base_adapter/line_protocol.hpp"

namespace beckon {
namespace {

using ::testing::HasSubstr;

// The base's end of a serial line.
class Line {
 public:
  explicit Line(const std::filesystem::path& link) : link_(link) {
    std::array<char, 128> name{};
    termios raw{};
    cfmakeraw(&raw);
    if (openpty(&base_, &adapter_, name.data(), &raw, nullptr) != 0) {
      throw std::runtime_error("no pseudo-terminal");
    }
    fcntl(base_, F_SETFL, O_NONBLOCK);
    // Children must not keep it open.
    fcntl(base_, F_SETFD, FD_CLOEXEC);
    fcntl(adapter_, F_SETFD, FD_CLOEXEC);
    std::filesystem::create_symlink(name.data(), link_);
  }
  ~Line() {
    std::filesystem::remove(link_);
    close(base_);
    close(adapter_);
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  void Write(const std::string& text) const {
    ASSERT_EQ(write(base_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  // The newest whole line that the adapter wrote.
  std::string Newest() {
    std::array<char, 4096> bytes{};
    for (ssize_t count; (count = read(base_, bytes.data(), bytes.size())) > 0;) {
      heard_.append(bytes.data(), static_cast<std::size_t>(count));
    }
    const std::size_t end = heard_.rfind('\n');
    if (end == std::string::npos) return "";
    const std::size_t start = end == 0 ? std::string::npos : heard_.rfind('\n', end - 1);
    const std::size_t from = start == std::string::npos ? 0 : start + 1;
    return heard_.substr(from, end + 1 - from);
  }

 private:
  std::filesystem::path link_;
  int base_ = -1;
  int adapter_ = -1;
  std::string heard_;
};

class BaseAdapterProgram : public ::testing::Test {
 protected:
  BaseAdapterProgram() {
    config_ = files_.Write(
        "robot.toml", "[robot]\ncentre_x_m = -0.1\n[base_adapter]\ndevice = '" + Port() + "'\n");
  }
  std::string Port() const { return (files_.path() / "base").string(); }
  void Drive(double linear, double angular) {
    velocity_command_t command{};
    command.utime = SystemClock().Now().utime;
    command.linear_mps = linear;
    command.angular_radps = angular;
    bus_.Publish(channels::kDrive, command);
  }
  bool IsHealthy(std::int8_t state, const std::string& reason = "") const {
    return healths_.size() > 0 && healths_.messages().back().state == state &&
           healths_.messages().back().reason.find(reason) != std::string::npos;
  }

  testing::TempDir files_;
  std::filesystem::path config_;
  MessageBus bus_{kDefaultLcmUrl};
  testing::Collector<bot_core::pose_t> odometry_{bus_, channels::kOdometry};
  testing::Collector<service_health_t> healths_{bus_, channels::kHealth};
};

TEST_F(BaseAdapterProgram, CommandsGoOutOdometryComesInAndSilenceIsAStop) {
  Line line(Port());
  testing::Process program("base_adapter", {"--config", config_.string()});
  const std::string stop = VelocityLine(0.0, 0.0);
  ASSERT_TRUE(testing::DispatchUntil(bus_, [&] { return line.Newest() == stop; }));
  const std::string command = VelocityLine(0.3, -0.2);
  ASSERT_TRUE(testing::DispatchUntil(bus_, [&] {
    Drive(0.3, -0.2);
    return line.Newest() == command;
  }));
  EXPECT_TRUE(testing::DispatchUntil(bus_, [&] { return line.Newest() == stop; }))
      << "nobody commands any more";

  // In pieces, with garbage between.
  const std::string odometry = ChecksummedLine("O 1.0 2.0 0.0");
  line.Write("\xff\xfe" + odometry.substr(0, 5));
  testing::DispatchUntil(
      bus_, [] { return false; }, std::chrono::milliseconds(50));
  line.Write(odometry.substr(5) + "O 7 7 7*00\n\x80\x01\n" + ChecksummedLine("O 1.5 2.0 0.0"));
  ASSERT_TRUE(testing::DispatchUntil(bus_, [&] { return odometry_.size() >= 1; }));
  EXPECT_NEAR(odometry_.messages().back().pos[0], 1.6, 1e-9);
  EXPECT_NEAR(odometry_.messages().back().pos[1], 2.0, 1e-9);
  EXPECT_TRUE(testing::DispatchUntil(bus_, [&] {
    line.Write(odometry);
    return IsHealthy(service_health_t::OK) && healths_.messages().back().refused >= 2;
  }));
  EXPECT_TRUE(testing::DispatchUntil(
      bus_, [&] { return IsHealthy(service_health_t::DEGRADED, "no odometry"); }));
  program.Signal(SIGTERM);
  EXPECT_EQ(program.WaitForExit(), 0);
  EXPECT_EQ(line.Newest(), stop);
}

TEST_F(BaseAdapterProgram, ABaseThatGoesAwayIsFoundAgain) {
  const std::string stop = VelocityLine(0.0, 0.0);
  testing::Process program("base_adapter", {"--config", config_.string()});
  ASSERT_TRUE(testing::DispatchUntil(
      bus_, [&] { return IsHealthy(service_health_t::FAILED, "cannot open"); }));
  {
    Line line(Port());
    ASSERT_TRUE(testing::DispatchUntil(bus_, [&] { return line.Newest() == stop; }));
  }
  ASSERT_TRUE(testing::DispatchUntil(bus_, [&] { return IsHealthy(service_health_t::FAILED); }));
  Line again(Port());
  ASSERT_TRUE(testing::DispatchUntil(bus_, [&] { return again.Newest() == stop; }));
  again.Write("\n" + ChecksummedLine("O 0 0 0"));
  EXPECT_TRUE(testing::DispatchUntil(bus_, [&] { return odometry_.size() == 1; }));
}

TEST_F(BaseAdapterProgram, NonsenseOnDriveIsAStop) {
  Line line(Port());
  testing::Process program("base_adapter", {"--config", config_.string()});
  const std::string command = VelocityLine(0.3, 0.0);
  ASSERT_TRUE(testing::DispatchUntil(bus_, [&] {
    Drive(0.3, 0.0);
    return line.Newest() == command;
  }));
  Drive(0.3, 0.0);
  Drive(std::nan(""), 0.0);
  EXPECT_TRUE(
      testing::DispatchUntil(bus_, [&] { return line.Newest() == VelocityLine(0.0, 0.0); }));
  EXPECT_TRUE(testing::DispatchUntil(
      bus_, [&] { return healths_.size() > 0 && healths_.messages().back().refused == 1; }));
}

TEST(BaseAdapterConfiguration, IsChecked) {
  testing::TempDir files;
  const auto config =
      files.Write("robot.toml", "[base_adapter]\ndevice = 'x'\ncommand_timeout_s = 2.0\n");
  const auto finished = testing::RunToEnd("base_adapter", {"--config", config.string()});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_THAT(finished.output, HasSubstr("robot.toml:3"));
}

}  // namespace
}  // namespace beckon
