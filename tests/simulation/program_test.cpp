// simulate_robot as it is used: prepared, driven over LCM, watched through its camera and radio,
// ended.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "beckon/call_t.hpp"
#include "beckon/velocity_command_t.hpp"
#include "bot_core/pose_t.hpp"
#include "common/channels.hpp"
#include "common/ground_camera.hpp"
#include "common/pose_message.hpp"
#include "common/site.hpp"
#include "services/camera_grabber/http_source.hpp"
#include "tests/support/process.hpp"

namespace beckon {
namespace {

using testing::Collector;
using testing::DispatchUntil;
using ::testing::HasSubstr;
using testing::Process;
using testing::RunToEnd;
using ::testing::SizeIs;
using testing::TempDir;

constexpr int kPort = 18090;

std::string RobotFile(const TempDir& folder) {
  return folder
      .Write("robot.toml",
             "[site]\nfolder = 'site'\n[camera]\ncalibration = 'camera.toml'\n"
             "[robot]\nradius_m = 0.25\ncentre_x_m = -0.15\nmax_speed_mps = 0.5\nmax_turn_radps = "
             "1.0\n"
             "max_acceleration_mps2 = 1.0\nmax_turn_acceleration_radps2 = 2.0\n"
             "[simulate_robot]\nhttp_port = " +
                 std::to_string(kPort) + "\nxbee_link = 'xbee'\n")
      .string();
}

class SimulateRobot : public ::testing::Test {
 protected:
  SimulateRobot() {
    const auto prepared =
        RunToEnd("simulate_robot", {"--prepare", folder_.path().string(), "--seed", "4"});
    EXPECT_EQ(prepared.exit_code, 0) << prepared.output;
    robot_file_ = RobotFile(folder_);
  }

  void Drive(MessageBus& bus, double linear, double angular) {
    velocity_command_t command{};
    command.sequence = ++sequence_;
    command.linear_mps = linear;
    command.angular_radps = angular;
    bus.Publish(channels::kDrive, command);
  }

  TempDir folder_;
  std::string robot_file_;
  std::int64_t sequence_ = 0;
};

TEST_F(SimulateRobot, PreparesWhatTheServicesRead) {
  EXPECT_GE(Site::Load(folder_.path() / "site").beacons.size(), 4U);
  EXPECT_EQ(GroundCamera::Load(folder_.path() / "camera.toml").width, 640);
}

TEST_F(SimulateRobot, DrivesTurnsTellsTheTruthAndStopsWithoutCommands) {
  MessageBus bus(kDefaultLcmUrl);
  Collector<bot_core::pose_t> odometry(bus, channels::kOdometry);
  Collector<call_t> calls(bus, channels::kCall);
  const std::string truth_file = (folder_.path() / "truth.json").string();
  Process robot("simulate_robot", {"--config", robot_file_, "--seed", "4", "--call-after", "0.5",
                                   "--truth", truth_file});
  ASSERT_TRUE(DispatchUntil(bus, [&] { return calls.size() > 0; })) << robot.Output();
  EXPECT_EQ(calls.messages()[0].tag, "caller");
  EXPECT_EQ(calls.messages()[0].kind, call_t::TAG);

  const Pose2 start = PoseFromMessage(odometry.messages().back());
  ASSERT_TRUE(DispatchUntil(bus, [&] {
    Drive(bus, 0.0, 0.8);
    return std::abs(WrapAngle(PoseFromMessage(odometry.messages().back()).theta - start.theta)) >
           0.5;
  })) << robot.Output();
  // A command that is no number is a stop, at once: braking takes 0.4 s, and the timeout of 0.3 s
  // is not waited for.
  odometry.Clear();
  Drive(bus, std::numeric_limits<double>::quiet_NaN(), 0.8);
  ASSERT_TRUE(DispatchUntil(bus, [&] {
    return odometry.size() > 0 && odometry.messages().back().rotation_rate[2] == 0.0;
  }));
  EXPECT_GT(odometry.messages().front().rotation_rate[2], 0.0);
  EXPECT_LT(odometry.messages().back().utime - odometry.messages().front().utime, 550'000);
  EXPECT_THAT(robot.Output(), HasSubstr("the base stops"));

  // A bad command moves nothing, and does no harm to those after it.
  testing::PublishRaw(channels::kDrive, {1, 2, 3});
  Drive(bus, std::numeric_limits<double>::quiet_NaN(), 0.0);
  odometry.Clear();
  ASSERT_TRUE(DispatchUntil(bus, [&] { return odometry.size() > 10; }));
  EXPECT_EQ(odometry.messages().back().rotation_rate[2], 0.0);
  ASSERT_TRUE(DispatchUntil(bus, [&] {
    Drive(bus, 0.0, -0.8);
    return odometry.messages().back().rotation_rate[2] < -0.5;
  }));

  robot.Signal(SIGTERM);
  EXPECT_EQ(robot.WaitForExit(), 0);
  std::ifstream stream(truth_file);
  std::string line;
  std::string last;
  while (std::getline(stream, line)) last = line;
  const auto truth = nlohmann::json::parse(last);
  EXPECT_TRUE(truth.at("summary").get<bool>());
  EXPECT_EQ(truth.at("collisions"), 0);
  EXPECT_GT(truth.at("distance_to_caller_m"), 1.0);
  EXPECT_THAT(robot.Output(), HasSubstr(last));
}

TEST_F(SimulateRobot, ServesItsCameraAndItsRadio) {
  Process robot("simulate_robot", {"--config", robot_file_, "--seed", "4"});
  ASSERT_TRUE(robot.WaitForOutput("camera at")) << robot.Output();
  const SystemClock clock;
  const auto camera =
      OpenHttpSource("http://127.0.0.1:" + std::to_string(kPort) + "/stream", clock);
  std::vector<Frame> frames;
  for (int i = 0; i < 100 && frames.size() < 5; ++i) {
    if (auto frame = camera->Next(std::chrono::milliseconds(100)))
      frames.push_back(std::move(*frame));
  }
  ASSERT_THAT(frames, SizeIs(5));
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GT(frames[i].utime, frames[i - 1].utime);
  EXPECT_EQ(frames[0].width, 640);
  const cv::Mat picture = cv::imdecode(frames[0].jpeg, cv::IMREAD_COLOR);
  ASSERT_FALSE(picture.empty());
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(picture, mean, deviation);
  EXPECT_GT(deviation[1], 5.0);  // not a blank picture

  const int port = open((folder_.path() / "xbee").c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY);
  ASSERT_GE(port, 0);
  std::string bytes;
  for (int i = 0; i < 50 && bytes.find("caller -") == std::string::npos; ++i) {
    pollfd waiting{port, POLLIN, 0};
    poll(&waiting, 1, 100);
    char buffer[256];
    const ssize_t size = read(port, buffer, sizeof(buffer));
    if (size > 0) bytes.append(buffer, static_cast<std::size_t>(size));
  }
  close(port);
  EXPECT_THAT(bytes, HasSubstr("caller -"));
  robot.Signal(SIGTERM);
  EXPECT_EQ(robot.WaitForExit(), 0);
  EXPECT_FALSE(std::filesystem::is_symlink(folder_.path() / "xbee"));
}

TEST_F(SimulateRobot, WritesASequenceWithItsTruth) {
  const auto folder = folder_.path() / "sequence";
  const auto done =
      RunToEnd("simulate_robot", {"--sequence", folder.string(), "--seed", "2", "--frames", "3"});
  ASSERT_EQ(done.exit_code, 0) << done.output;
  EXPECT_EQ(GroundCamera::Load(folder / "sequence.toml").width, 640);
  const cv::Mat frame = cv::imread((folder / "frames/000002.jpg").string());
  const cv::Mat truth = cv::imread((folder / "truth/000002.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(frame.size(), cv::Size(640, 480));
  ASSERT_EQ(truth.type(), CV_8UC1);
  EXPECT_EQ(cv::countNonZero(truth == 1) + cv::countNonZero(truth == 2), 640 * 480);

  const auto again = RunToEnd("simulate_robot", {"--sequence", folder.string(), "--frames", "1"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.output, HasSubstr("not empty"));
}

TEST_F(SimulateRobot, ABadConfigurationIsExitCodeTwoWithTheKey) {
  std::ofstream(robot_file_, std::ios::app) << "htp_port = 1\n";
  const auto done = RunToEnd("simulate_robot", {"--config", robot_file_});
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.output, HasSubstr("htp_port"));
}

TEST_F(SimulateRobot, APortOrLinkThatIsTakenIsToldAndEndsIt) {
  Process first("simulate_robot", {"--config", robot_file_});
  ASSERT_TRUE(first.WaitForOutput("camera at"));
  const auto second = RunToEnd("simulate_robot", {"--config", robot_file_});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_THAT(second.output, HasSubstr(std::to_string(kPort)));
  first.Signal(SIGTERM);
  EXPECT_EQ(first.WaitForExit(), 0);

  folder_.Write("xbee", "not a link");
  const auto third = RunToEnd("simulate_robot", {"--config", robot_file_});
  EXPECT_EQ(third.exit_code, 1);
  EXPECT_THAT(third.output, HasSubstr("xbee"));
}

}  // namespace
}  // namespace beckon
