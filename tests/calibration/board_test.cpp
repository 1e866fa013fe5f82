// Boards in simulated pictures: found, and a camera calibrated from them, through the program.
#include <gmock/gmock.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "tests/calibration/simulated_camera.hpp"
#include "tests/support/process.hpp"
#include "tools/calibration/lens.hpp"

namespace beckon {
namespace {

using testing::Finished;
using ::testing::HasSubstr;
using testing::SimulatedCamera;

Board ChartOf(BoardKind kind) {
  Board board;
  board.kind = kind;
  if (kind == BoardKind::kCharuco) board.square_m = 0.04, board.marker_m = 0.03;
  return board;
}

constexpr double kAcross = -0.5 * 3.14159265358979;  // rows from left to right

TEST(FindBoard, CornersAreWhereTheyAreDrawn) {
  const SimulatedCamera camera;
  for (const BoardKind kind : {BoardKind::kChessboard, BoardKind::kCharuco}) {
    const Board board = ChartOf(kind);
    const Eigen::Isometry3d pose = testing::HeldBoards(board, 1)[0];
    const auto corners = FindBoard(camera.Take(board, {pose}), board, "held");
    ASSERT_GT(corners.size(), 45U);  // of 54
    const auto errors = [&](const std::vector<BoardCorner>& found) {
      double squares = 0.0;
      for (const BoardCorner& corner : found) {
        const Eigen::Vector3d place(corner.board_m.x(), corner.board_m.y(), 0.0);
        squares += (camera.PixelOf(pose * place) - corner.pixel).squaredNorm();
      }
      return std::sqrt(squares / static_cast<double>(found.size()));
    };
    EXPECT_LT(std::min(errors(corners), errors(HalfTurned(corners, board))), 0.25)
        << static_cast<int>(kind);
  }
}

TEST(CalibrateLens, FindsTheLensOfASimulatedCamera) {
  const SimulatedCamera camera;
  const Board board = ChartOf(BoardKind::kChessboard);
  std::vector<std::vector<BoardCorner>> pictures;
  for (const Eigen::Isometry3d& pose : testing::HeldBoards(board, 10)) {
    pictures.push_back(FindBoard(camera.Take(board, {pose}), board, "held"));
  }
  const Lens lens = CalibrateLens(pictures, camera.size);
  EXPECT_NEAR(lens.fx / camera.lens.fx, 1.0, 0.005);
  EXPECT_NEAR(lens.fy / camera.lens.fy, 1.0, 0.005);
  EXPECT_LT(lens.rms_px, 0.2);
  for (double u = 60.0; u < 640.0; u += 130.0) {
    for (double v = 60.0; v < 480.0; v += 90.0) {
      // What lens and centre together make of a pixel: the direction it looks in.
      const auto direction = [&](const Lens& of) {
        const Eigen::Vector2d ideal = of.Undistorted({u, v});
        return Eigen::Vector2d((ideal.x() - of.cx) / of.fx, (ideal.y() - of.cy) / of.fy);
      };
      EXPECT_LT((direction(lens) - direction(camera.lens)).norm() * camera.lens.fx, 3.0)
          << u << " " << v;
    }
  }
  const std::vector<std::vector<BoardCorner>> same(6, pictures[0]);
  EXPECT_THROW(CalibrateLens(same, camera.size), CalibrationError);
  EXPECT_THROW(CalibrateLens({pictures[0]}, camera.size), CalibrationError);
}

class CalibrateGround : public ::testing::Test {
 protected:
  std::string Save(const std::string& name, const cv::Mat& picture) {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    EXPECT_TRUE(cv::imwrite(path.string(), picture));
    return path.string();
  }
  Finished Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--output", Output().string()});
    return testing::RunToEnd("calibrate_ground", arguments);
  }
  std::filesystem::path Output() const { return folder_.path() / "camera.toml"; }
  std::string Marks(const std::vector<Eigen::Vector2d>& places) {
    std::string text = "u,v,x_m,y_m\n";
    for (const Eigen::Vector2d& place : places) {
      const Eigen::Vector2d pixel = camera_.PixelOfFloor(place);
      char line[128];
      // As read off a screen: whole pixels.
      std::snprintf(line, sizeof(line), "%.0f,%.0f,%.3f,%.3f\n", pixel.x(), pixel.y(), place.x(),
                    place.y());
      text += line;
    }
    return text;
  }
  void ExpectRanges(double tolerance) {
    const GroundCamera found = GroundCamera::Load(Output());
    for (int range = 1; range <= 6; ++range) {
      const auto point =
          found.GroundFromPixel(found.Undistorted(camera_.PixelOfFloor({1.0 * range, 0.2})));
      ASSERT_TRUE(point);
      EXPECT_NEAR(point->norm() / std::hypot(range, 0.2), 1.0, tolerance) << range << " m";
    }
  }

  SimulatedCamera camera_;
  testing::TempDir folder_;
};

TEST_F(CalibrateGround, BoardsMarksAndLensPicturesTogether) {
  const Board chart = ChartOf(BoardKind::kCharuco);
  const auto held = testing::HeldBoards(chart, 8);
  for (std::size_t i = 0; i < held.size(); ++i) {
    Save("lens/" + std::to_string(i) + ".png", camera_.Take(chart, {held[i]}));
  }
  Save("floor_1.png", camera_.Take(chart, {camera_.OnFloor({1.0, 0.16}, kAcross)}));
  // Along the robot's way, and measured at the other long side: the page is upside down.
  Save("floor_2.png", camera_.Take(chart, {camera_.OnFloor({0.8, 0.1}, 0.0)}));
  folder_.Write("marks.csv", Marks({{2.0, 0.8}, {3.0, -1.0}, {4.0, 1.0}, {5.0, -0.5}}));
  const auto session = folder_.Write("session.toml", R"(
camera_height_m = 0.55
lens_pictures = "lens"
marks = "marks.csv"
[board]
kind = "charuco"
columns = 10
rows = 7
square_m = 0.04
marker_m = 0.03
[[views]]
picture = "floor_1.png"
first_corner = [1.002, 0.161]
second_corner = [1.001, -0.162]
[[views]]
picture = "floor_2.png"
first_corner = [1.119, -0.102]
second_corner = [0.798, -0.099]
)");
  const auto grid = folder_.path() / "grid.jpg";
  const Finished finished = Run({session.string(), "--grid", grid.string()});
  ASSERT_EQ(finished.exit_code, 0) << finished.output;
  EXPECT_THAT(finished.output, HasSubstr("2 boards, 4 marks"));
  EXPECT_THAT(finished.output, HasSubstr("  6 m"));
  ExpectRanges(0.02);
  EXPECT_NEAR(GroundCamera::Load(Output()).height_m, 0.55, 0.005);
  const cv::Mat drawn = cv::imread(grid.string());
  EXPECT_EQ(drawn.size(), camera_.size);
  EXPECT_GT(cv::norm(drawn, cv::imread((folder_.path() / "floor_1.png").string()), cv::NORM_L1),
            1e5);
}

TEST_F(CalibrateGround, MarksAloneOfACameraWithoutDistortion) {
  camera_.lens = {480.0, 480.0, 319.5, 239.5, {}, 0.0};
  const auto picture = Save("floor.png", cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(90)));
  const auto marks = folder_.Write("marks.csv", Marks({{0.8, 0.3},
                                                       {0.8, -0.3},
                                                       {1.5, 0.5},
                                                       {1.5, -0.5},
                                                       {3.0, 1.0},
                                                       {3.0, -1.0},
                                                       {5.0, 1.0},
                                                       {5.0, -1.0}}));
  const Finished finished = Run({marks.string(), "--picture", picture, "--height", "0.55"});
  ASSERT_EQ(finished.exit_code, 0) << finished.output;
  ExpectRanges(0.03);
  // The lens of that, for a camera that was only turned.
  camera_.tilt_down_rad += 0.05;
  folder_.Write("marks.csv", Marks({{0.8, 0.3}, {0.8, -0.3}, {4.0, 1.0}, {4.0, -1.0}}));
  const auto lens = folder_.path() / "lens.toml";
  std::filesystem::rename(Output(), lens);
  const Finished again =
      Run({marks.string(), "--picture", picture, "--lens", lens.string(), "--height", "0.55"});
  ASSERT_EQ(again.exit_code, 0) << again.output;
  ExpectRanges(0.04);
}

TEST_F(CalibrateGround, SaysWhatIsWrongAndWhere) {
  const auto picture = Save("floor.png", cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(90)));
  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& why) {
    const Finished finished = Run(arguments);
    EXPECT_EQ(finished.exit_code, 2) << why;
    EXPECT_THAT(finished.output, HasSubstr(why));
    EXPECT_FALSE(std::filesystem::exists(Output()));
  };
  const auto csv = [&](const std::string& text) {
    return folder_.Write("marks.csv", text).string();
  };
  refused({csv(Marks({{1.0, 0.1}, {2.0, 0.0}, {3.0, 0.0}}))}, "--picture");
  refused({csv(Marks({{1.0, 0.1}, {2.0, 0.0}, {3.0, 0.0}})), "--picture", picture}, "too few");
  refused({csv("u,v,x,y\n"), "--picture", picture}, "marks.csv:1");
  refused({csv("u,v,x_m,y_m\n1,2,3,4\n10,nan,1,1\n"), "--picture", picture}, "marks.csv:3");
  refused({csv("u,v,x_m,y_m\n900,100,3,0\n"), "--picture", picture}, "marks.csv:2");
  refused({csv("u,v,x_m,y_m\n90,100,3,0\n90,100,4,0\n"), "--picture", picture}, "marks.csv:3");
  refused({csv(""), "--picture", folder_.Write("cut.jpg", "\xff\xd8").string()}, "cut.jpg");

  const std::string session = R"([board]
columns = 10
rows = 7
square_m = 0.03
[[views]]
picture = "floor.png"
first_corner = [1.0, 0.12]
second_corner = [1.0, -0.12]
)";
  const auto toml = [&](const std::string& text) {
    return folder_.Write("session.toml", text).string();
  };
  refused({toml(session)}, "floor.png: no chessboard of 10 x 7 squares");
  refused({toml("rwos = 3\n" + session)}, "session.toml:1: rwos");
  refused({toml("[board]\ncolumns = 7\nrows = 7\nsquare_m = 0.03\n[[views]]\n")}, "board.rows");
  Save("small.png", cv::Mat(240, 320, CV_8UC3));
  refused({toml("picture = \"small.png\"\n" + session)}, "floor.png: is 640 x 480");
  refused({"/nowhere.toml"}, "/nowhere.toml");
  const Board chart = ChartOf(BoardKind::kChessboard);
  Save("floor.png", camera_.Take(chart, {camera_.OnFloor({1.0, 0.12}, kAcross)}));
  std::string wrong = session;
  wrong.replace(wrong.find("-0.12"), 5, "-0.30");
  refused({toml(wrong)}, "0.420 m as measured, but 0.240 m");
}

}  // namespace
}  // namespace beckon
