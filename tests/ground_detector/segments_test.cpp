// The small picture: segments, evidence, beliefs, colours.
#include <gtest/gtest.h>
#include <Eigen/LU>

#include <opencv2/imgproc.hpp>

#include "services/ground_detector/colour_model.hpp"
#include "services/ground_detector/foot_line.hpp"
#include "services/ground_detector/mean_shift.hpp"
#include "services/ground_detector/parallax.hpp"
#include "services/ground_detector/random_walk.hpp"
#include "services/ground_detector/segment_classifier.hpp"
#include "tests/ground_detector/scene.hpp"

namespace beckon {
namespace {

cv::Vec3f HsiOf(const cv::Vec3b& bgr) {
  return HsiFromBgr(cv::Mat(1, 1, CV_8UC3, cv::Scalar(bgr[0], bgr[1], bgr[2]))).at<cv::Vec3f>(0, 0);
}

TEST(HsiFromBgr, IsTheColourCircle) {
  // Pure red, green, blue: a third of the circle apart, saturation 1, intensity 1/3.
  EXPECT_NEAR(HsiOf({0, 0, 255})[0], 0.0F, 1e-6F);
  EXPECT_NEAR(HsiOf({0, 255, 0})[0], 1.0F / 3.0F, 1e-6F);
  EXPECT_NEAR(HsiOf({255, 0, 0})[0], 2.0F / 3.0F, 1e-6F);
  EXPECT_NEAR(HsiOf({0, 0, 255})[1], 1.0F, 1e-6F);
  EXPECT_NEAR(HsiOf({0, 0, 255})[2], 1.0F / 3.0F, 1e-6F);
}

TEST(HsiFromBgr, SetsTheColourlessApart) {
  EXPECT_EQ(HsiOf({128, 128, 128})[0], kColourlessHue);
  EXPECT_EQ(HsiOf({128, 128, 140})[0], kColourlessHue);  // saturation 0.03
  EXPECT_EQ(HsiOf({0, 0, 30})[0], kColourlessHue);       // intensity 0.04
  EXPECT_NE(HsiOf({100, 100, 140})[0], kColourlessHue);
  EXPECT_EQ(HsiOf({0, 0, 0})[1], 0.0F);
}

cv::Mat TwoHalves(const cv::Scalar& left, const cv::Scalar& right, double noise) {
  cv::Mat picture(24, 32, CV_8UC3, left);
  picture.colRange(16, 32).setTo(right);
  cv::Mat grain(picture.size(), CV_16SC3);
  cv::RNG random(3);
  random.fill(grain, cv::RNG::NORMAL, 0.0, noise);
  cv::Mat sum;
  picture.convertTo(sum, CV_16SC3);
  sum += grain;
  sum.convertTo(picture, CV_8UC3);
  return picture;
}

void ExpectTwoHalves(const Segmentation& segments) {
  EXPECT_EQ(segments.count, 2);
  for (int v = 0; v < 24; ++v) {
    for (int u = 0; u < 32; ++u) {
      EXPECT_EQ(segments.ids.at<int>(v, u), segments.ids.at<int>(0, u < 16 ? 0 : 31))
          << u << ' ' << v;
    }
  }
}

TEST(MeanShiftSegments, PartsColours) {
  ExpectTwoHalves(
      MeanShiftSegments(HsiFromBgr(TwoHalves({40, 60, 180}, {150, 140, 130}, 0.8)), {}));
}

TEST(MeanShiftSegments, PartsPaleColoursOfOneIntensity) {
  const cv::Mat picture = TwoHalves({187, 196, 190}, {192, 187, 194}, 0.6);
  ExpectTwoHalves(MeanShiftSegments(HsiFromBgr(picture, 0.01F), {}));
}

TEST(MeanShiftSegments, KeepsTextureTogether) {
  EXPECT_EQ(
      MeanShiftSegments(HsiFromBgr(TwoHalves({130, 130, 130}, {130, 130, 130}, 6.0)), {}).count, 1);
}

TEST(RefineSegments, FindsTheBorderToThePixel) {
  // A slanted border between two colours, which the cells of 10 x 10 pixels can only follow in
  // steps.
  const cv::Scalar left(40, 60, 180);
  const cv::Scalar right(150, 140, 130);
  cv::Mat picture(240, 320, CV_8UC3, left);
  const auto border = [](int v) { return 143 + v / 7; };
  for (int v = 0; v < picture.rows; ++v) {
    picture.row(v).colRange(border(v), picture.cols).setTo(right);
  }
  cv::Mat cells;
  cv::resize(picture, cells, {32, 24}, 0.0, 0.0, cv::INTER_AREA);
  const Segmentation segments = MeanShiftSegments(HsiFromBgr(cells, 0.01F), {});
  const cv::Mat ids = RefineSegments(picture, segments);
  ASSERT_EQ(ids.size(), picture.size());
  const int left_id = ids.at<int>(0, 0);
  const int right_id = ids.at<int>(0, 319);
  ASSERT_NE(left_id, right_id);
  int wrong = 0;
  for (int v = 0; v < ids.rows; ++v) {
    for (int u = 0; u < ids.cols; ++u) {
      wrong += ids.at<int>(v, u) != (u < border(v) ? left_id : right_id) ? 1 : 0;
    }
  }
  EXPECT_LT(wrong, 24);  // a tenth of a pixel in each row
}

TEST(GroundEvidence, TellsTheFloorFromABoxAndAdmitsTheRest) {
  const GroundCamera camera = testing::TestCamera();
  testing::Scene scene;
  scene.boxes.push_back({{1.5, -0.3}, {1.8, 0.3}, 0.4, {120.0, 140.0, 150.0}});
  const Pose2 before_from_now{0.15, 0.0, 0.0};
  const auto half = [&](const Pose2& pose, unsigned seed) {
    cv::Mat grey;
    cv::cvtColor(testing::Render(scene, camera, pose, seed).bgr, grey, cv::COLOR_BGR2GRAY);
    cv::resize(grey, grey, {}, 0.5, 0.5, cv::INTER_AREA);
    return grey;
  };
  const cv::Size cells(32, 24);
  const cv::Mat evidence = GroundEvidence(camera, half(before_from_now, 1), half({}, 2),
                                          {before_from_now, 0.0, 0.0}, {}, cells, {});
  // Floor before the box, and the box's upper edge, which lies well above the ground.
  EXPECT_GT(cv::mean(evidence.rowRange(18, 23))[0], 0.25);
  const auto edge = camera.PixelFromGround(Eigen::Vector2d(1.35, 0.0) * 0.5 / 0.1);
  ASSERT_TRUE(edge);
  EXPECT_LT(cv::mean(evidence(cv::Rect(14, static_cast<int>(edge->y() / 10.0), 4, 1)))[0], -0.25);
  // Above the horizon nothing is said; nor of a plain floor.
  EXPECT_EQ(evidence.at<float>(0, 5), 0.0F);
  scene.floor_contrast = 0.0;
  scene.boxes.clear();
  const cv::Mat plain = GroundEvidence(camera, half(before_from_now, 1), half({}, 2),
                                       {before_from_now, 0.0, 0.0}, {}, cells, {});
  EXPECT_LT(std::abs(cv::mean(plain.rowRange(10, 23))[0]), 0.1);
}

// Half-size grey picture of a floor and of a wall across it at x = 2 m, both of one texture.
cv::Mat FloorAndWall(const GroundCamera& camera, double camera_x, double contrast) {
  constexpr double kWallX = 2.0;
  cv::Mat grey(camera.height / 2, camera.width / 2, CV_8UC1);
  for (int v = 0; v < grey.rows; ++v) {
    for (int u = 0; u < grey.cols; ++u) {
      const double right = (2.0 * u + 0.5 - camera.cx) / camera.fx;
      const double down = (2.0 * v + 0.5 - camera.cy) / camera.fy;
      const double tilt = camera.tilt_down_rad;
      const Eigen::Vector3d ray(std::cos(tilt) - down * std::sin(tilt), -right,
                                -std::sin(tilt) - down * std::cos(tilt));
      const double to_wall = (kWallX - camera_x) / ray.x();
      const double to_floor = ray.z() < 0.0 ? -camera.height_m / ray.z() : 1e9;
      const double y = ray.y() * std::min(to_wall, to_floor);
      const double other = to_floor < to_wall ? camera_x + to_floor * ray.x()
                                              : 7.0 + camera.height_m + to_wall * ray.z();
      const double wave = std::sin(17.0 * y + 9.0 * other) + std::sin(11.0 * y - 23.0 * other) +
                          std::sin(29.0 * y + 3.0) * std::sin(31.0 * other);
      grey.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(128.0 + contrast * wave);
    }
  }
  return grey;
}

TEST(FootLogOdds, FindsTheFootOfAWallThatLooksLikeTheFloor) {
  const GroundCamera camera = testing::TestCamera();
  const BodyPose before{{-0.25, 0.0, 0.0}, 0.0, 0.0};
  const auto foot = camera.PixelFromGround(Eigen::Vector2d(2.0, 0.0));
  ASSERT_TRUE(foot);
  const int foot_row = cvRound(0.5 * foot->y() - 0.25);
  for (const int error : {-7, 7}) {
    const cv::Mat now = FloorAndWall(camera, 0.0, 25.0);
    const cv::Mat then = FloorAndWall(camera, -0.25, 25.0);
    cv::Mat ground(now.size(), CV_8UC1, cv::Scalar(0));
    ground.rowRange(foot_row + error, ground.rows).setTo(255);
    const std::vector<PosedGrey> earlier = {{&then, before}};
    const cv::Mat feet = FootLogOdds(camera, {&now, {}}, earlier, ground, ground | 255, {});
    ASSERT_EQ(feet.size(), now.size());
    for (int u = 30; u < 130; u += 10) {
      EXPECT_LT(feet.at<float>(foot_row - 2, u), 0.0F) << u << ", cells err by " << error;
      EXPECT_GT(feet.at<float>(foot_row + 3, u), 0.0F) << u << ", cells err by " << error;
    }
  }
}

// The robot is said to have gone aside by 5 cm as well: even the ground does not agree.
TEST(FootLogOdds, SaysNothingWhereTheMotionIsWrong) {
  const GroundCamera camera = testing::TestCamera();
  const cv::Mat now = FloorAndWall(camera, 0.0, 25.0);
  const cv::Mat then = FloorAndWall(camera, -0.25, 25.0);
  cv::Mat ground(now.size(), CV_8UC1, cv::Scalar(0));
  ground.rowRange(60, ground.rows).setTo(255);
  const auto at = [&](double y_m) {
    const std::vector<PosedGrey> earlier = {{&then, {{-0.25, y_m, 0.0}, 0.0, 0.0}}};
    const cv::Mat feet = FootLogOdds(camera, {&now, {}}, earlier, ground, ground | 255, {});
    return std::abs(feet.at<float>(50, 80)) + std::abs(feet.at<float>(70, 80));
  };
  EXPECT_GT(at(0.0), 2.0F);
  EXPECT_EQ(at(0.05), 0.0F);
}

TEST(FootLogOdds, SaysNothingOfWhatIsPlain) {
  const GroundCamera camera = testing::TestCamera();
  const cv::Mat plain = FloorAndWall(camera, 0.0, 0.0);
  cv::Mat ground(plain.size(), CV_8UC1, cv::Scalar(0));
  ground.rowRange(60, ground.rows).setTo(255);
  const std::vector<PosedGrey> earlier = {{&plain, {{-0.25, 0.0, 0.0}, 0.0, 0.0}}};
  const cv::Mat feet = FootLogOdds(camera, {&plain, {}}, earlier, ground, ground | 255, {});
  EXPECT_NEAR(feet.at<float>(55, 80), 0.0F, 0.5F);
  EXPECT_NEAR(feet.at<float>(65, 80), 0.0F, 0.5F);
}

TEST(SpreadBeliefs, GoesAlongWhatLooksAlikeAndStopsAtEdges) {
  const cv::Size size(30, 10);
  cv::Mat colours(size, CV_32FC3, cv::Scalar(0.0, 0.0, 0.0));
  colours.colRange(15, 30).setTo(cv::Scalar(0.0, 0.0, 5.0));
  CellBeliefs beliefs(size);
  beliefs.Add(5, 0, 4.0F, 1.0F);
  beliefs.Add(5, 29, -4.0F, 1.0F);
  const cv::Mat field = SpreadBeliefs(beliefs, colours, colours, {});
  for (int v = 0; v < size.height; ++v) {
    EXPECT_GT(field.at<float>(v, 14), 0.5F);
    EXPECT_LT(field.at<float>(v, 15), -0.5F);
  }
}

TEST(SpreadBeliefs, IsNoughtWhereNothingIsKnown) {
  const cv::Mat colours(8, 8, CV_32FC3, cv::Scalar(1.0, 1.0, 1.0));
  EXPECT_EQ(cv::countNonZero(SpreadBeliefs(CellBeliefs(colours.size()), colours, colours, {})), 0);
}

TEST(SpreadBeliefs, SolvesItsEquations) {
  // Two linked cells, w = 0.401: weights 1 for 2 and 1 for -1, and the pull of 0.002 to nought.
  CellBeliefs beliefs({2, 1});
  beliefs.Add(0, 0, 2.0F, 1.0F);
  beliefs.Add(0, 1, -1.0F, 1.0F);
  const cv::Mat colours(1, 2, CV_32FC3, cv::Scalar::all(0.0));
  const cv::Mat field = SpreadBeliefs(beliefs, colours, colours, {});
  Eigen::Matrix2d matrix;
  matrix << 1.403, -0.401, -0.401, 1.403;
  const Eigen::Vector2d expected = matrix.inverse() * Eigen::Vector2d(2.0, -1.0);
  EXPECT_NEAR(field.at<float>(0, 0), expected.x(), 1e-4);
  EXPECT_NEAR(field.at<float>(0, 1), expected.y(), 1e-4);
}

TEST(ColourModel, LearnsForgetsAndHasNoOpinionOfTheNew) {
  ColourModel model;
  EXPECT_FALSE(model.knows_ground());
  const cv::Vec3b floor(120, 140, 150);
  const cv::Vec3b wall(200, 190, 170);
  const cv::Vec3b paint(40, 60, 180);
  for (int i = 0; i < 100; ++i) {
    model.AddGround(floor);
    model.AddNotGround(wall);
  }
  model.EndFrame();
  EXPECT_TRUE(model.knows_ground());
  EXPECT_GT(model.LogRatio(floor), 2.0F);
  EXPECT_LT(model.LogRatio(wall), -2.0F);
  EXPECT_NEAR(model.LogRatio(paint), 0.0F, 0.2F);
  // One shade lighter is the same floor; in a shadow it is still likely; in a tenth of the light
  // nobody knows.
  EXPECT_GT(model.LogRatio({122, 142, 152}), 1.0F);
  EXPECT_GT(model.LogRatio({72, 84, 90}), 1.0F);
  EXPECT_LT(model.LogRatio({120, 114, 102}), -1.0F);
  EXPECT_NEAR(model.LogRatio({12, 14, 15}), 0.0F, 0.2F);
  // A new floor takes over.
  for (int frame = 0; frame < 300; ++frame) {
    for (int i = 0; i < 100; ++i) {
      model.AddGround(paint);
      model.AddNotGround(floor);
    }
    model.EndFrame();
  }
  EXPECT_GT(model.LogRatio(paint), 2.0F);
  EXPECT_LT(model.LogRatio(floor), -2.0F);
}

// The robot turns on the spot over floor that motion has confirmed, and something comes into view
// at the side. It is not the floor that it replaces there.
TEST(SegmentClassifier, WhatComesIntoViewIsNotTakenForTheFloorBesideIt) {
  const cv::Size size(64, 48);
  constexpr int kStepCells = 10;
  const cv::Mat nowhere(size, CV_8UC1, cv::Scalar(0));
  cv::Mat near = nowhere.clone();
  near(cv::Rect(20, 40, 24, 8)).setTo(255);
  const auto segments_of = [](const cv::Mat& bgr) {
    return MeanShiftSegments(HsiFromBgr(bgr, 0.01F), {});
  };
  SegmentClassifier classifier({});
  const cv::Mat floor(size, CV_8UC3, cv::Scalar(110, 160, 140));
  const Segmentation whole = segments_of(floor);
  const cv::Mat evidence(size, CV_32FC1, cv::Scalar(2.0));
  cv::Mat log_odds;
  for (int frame = 0; frame < 5; ++frame) {
    log_odds = classifier.Update({whole, floor, evidence, nowhere, nowhere, near,
                                  Eigen::Matrix3d(Eigen::Matrix3d::Identity())});
  }
  EXPECT_GT(log_odds.at<float>(24, 60), 1.0F);

  cv::Mat bgr = floor.clone();
  bgr.colRange(size.width - kStepCells, size.width).setTo(cv::Scalar(60, 120, 40));
  Eigen::Matrix3d before_from_now = Eigen::Matrix3d::Identity();
  before_from_now(0, 2) = kStepCells;
  log_odds =
      classifier.Update({segments_of(bgr), bgr, {}, nowhere, nowhere, near, before_from_now});
  EXPECT_GT(log_odds.at<float>(24, size.width - kStepCells - 3), 1.0F);
  EXPECT_LT(log_odds.at<float>(24, size.width - kStepCells + 3), 0.5F);
}

// The robot stands on floor that motion has confirmed, and somebody steps in before it.
TEST(SegmentClassifier, WhoStepsInIsNotTheFloorThatWasSeenThere) {
  const cv::Size size(64, 48);
  const cv::Mat nowhere(size, CV_8UC1, cv::Scalar(0));
  cv::Mat near = nowhere.clone();
  near(cv::Rect(20, 40, 24, 8)).setTo(255);
  SegmentClassifier classifier({});
  const auto see = [&](const cv::Mat& bgr, const cv::Mat& evidence) {
    const Segmentation segments = MeanShiftSegments(HsiFromBgr(bgr, 0.01F), {});
    return classifier.Update({segments, bgr, evidence, nowhere, nowhere, near,
                              Eigen::Matrix3d(Eigen::Matrix3d::Identity())});
  };
  const cv::Mat floor(size, CV_8UC3, cv::Scalar(110, 160, 140));
  for (int frame = 0; frame < 5; ++frame) see(floor, cv::Mat(size, CV_32FC1, cv::Scalar(2.0)));
  cv::Mat bgr = floor.clone();
  bgr(cv::Rect(24, 10, 14, 24)).setTo(cv::Scalar(60, 70, 90));
  cv::Mat log_odds;
  for (int frame = 0; frame < 10; ++frame) log_odds = see(bgr, {});
  EXPECT_LT(log_odds.at<float>(22, 31), 0.5F) << "that floor is hidden now";
  EXPECT_GT(log_odds.at<float>(22, 10), 1.0F) << "and this is not";
}

// Something fills the view before the robot, as after a turn on the spot.
TEST(SegmentClassifier, WhatLiesBeforeTheRobotIsGroundOnlyInAColourOfGround) {
  const cv::Size size(64, 48);
  const cv::Mat nowhere(size, CV_8UC1, cv::Scalar(0));
  cv::Mat near = nowhere.clone();
  near(cv::Rect(20, 40, 24, 8)).setTo(255);
  SegmentClassifier classifier({});
  const auto see = [&](const cv::Scalar& bgr) {
    const cv::Mat picture(size, CV_8UC3, bgr);
    const Segmentation segments = MeanShiftSegments(HsiFromBgr(picture, 0.01F), {});
    return classifier.Update({segments, picture, {}, nowhere, nowhere, near, std::nullopt})
        .at<float>(44, 32);
  };
  const cv::Scalar floor(110, 160, 140);
  EXPECT_GT(see(floor), 1.0F) << "the robot is switched on where there is a way to see";
  EXPECT_GT(see(floor), 1.0F);
  EXPECT_NEAR(see({25, 20, 20}), 0.0F, 0.1F);
  EXPECT_GT(see(floor), 1.0F);
}

// A robot whose camera looks level before a house of the same grey as the floor farther on, under a
// bridge of that grey.
TEST(SegmentClassifier, WhatIsHighAboveTheHorizonSaysNothingOfWhatStandsOnTheGround) {
  const cv::Size size(64, 48);
  cv::Mat above(size, CV_8UC1, cv::Scalar(0));
  above.rowRange(0, 24).setTo(255);
  cv::Mat just_above(size, CV_8UC1, cv::Scalar(0));
  just_above.rowRange(20, 24).setTo(255);
  cv::Mat near(size, CV_8UC1, cv::Scalar(0));
  near(cv::Rect(20, 40, 24, 8)).setTo(255);
  const cv::Scalar grey(150, 150, 150);
  cv::Mat picture(size, CV_8UC3, cv::Scalar(110, 160, 140));
  picture.rowRange(26, 36).setTo(grey);
  const auto strip_under = [&](int first_row, int last_row) {
    cv::Mat bgr = picture.clone();
    bgr.rowRange(0, 24).setTo(cv::Scalar(30, 40, 120));
    bgr.rowRange(first_row, last_row).setTo(grey);
    SegmentClassifier classifier({});
    const Segmentation segments = MeanShiftSegments(HsiFromBgr(bgr, 0.01F), {});
    cv::Mat log_odds;
    for (int frame = 0; frame < 5; ++frame) {
      log_odds =
          classifier.Update({segments, bgr, {}, above, just_above, near, std::nullopt}).clone();
    }
    return log_odds.at<float>(31, 32);
  };
  EXPECT_LT(strip_under(20, 24), -1.0F) << "grey things stand there";
  EXPECT_GT(strip_under(0, 4), strip_under(20, 24) + 1.0F) << "a bridge is grey";
}

}  // namespace
}  // namespace beckon
