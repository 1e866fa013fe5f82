// Corners, descriptors and their matches.
#include "services/ground_detector/features.hpp"

#include <dlib/image_keypoint.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <set>

#include "services/ground_detector/tracks.hpp"

namespace beckon {
namespace {

cv::Mat RandomPicture(int width, int height) {
  cv::Mat picture(height, width, CV_8UC1);
  cv::RNG random(7);
  random.fill(picture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(picture, picture, {}, 2.0);
  cv::normalize(picture, picture, 0, 255, cv::NORM_MINMAX);
  return picture;
}

TEST(UprightSurf, IsTheSameAsDlibs) {
  const cv::Mat picture = RandomPicture(120, 100);
  cv::Mat integral;
  cv::integral(picture, integral, CV_32S);
  dlib::array2d<unsigned char> copy(picture.rows, picture.cols);
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) copy[v][u] = picture.at<std::uint8_t>(v, u);
  }
  dlib::integral_image dlib_integral;
  dlib_integral.load(copy);
  for (const cv::Point point : {cv::Point(60, 50), cv::Point(50, 60), cv::Point(75, 40)}) {
    dlib::matrix<double, 64, 1> expected;
    dlib::compute_surf_descriptor(dlib_integral, dlib::point(point.x, point.y), 2.0, 0.0, expected);
    const SurfDescriptor found = UprightSurf(integral, point.x, point.y);
    for (int i = 0; i < 64; ++i) {
      EXPECT_NEAR(found[static_cast<std::size_t>(i)], expected(i), 1e-5) << i;
    }
  }
}

TEST(DetectFeatures, SpreadsCornersOverThePicture) {
  FeatureOptions options;
  // One half has far more contrast; the other gets its share all the same.
  cv::Mat picture = RandomPicture(320, 240);
  cv::Mat faint = picture.colRange(0, 160);
  faint.convertTo(faint, CV_8UC1, 0.3);
  const auto features = DetectFeatures(picture, options);
  std::set<std::pair<int, int>> cells;
  int in_faint_half = 0;
  for (const Feature& feature : features) {
    EXPECT_GE(feature.pixel.x, kFeatureBorderPx);
    EXPECT_LT(feature.pixel.y, 240 - kFeatureBorderPx);
    cells.emplace(static_cast<int>(feature.pixel.x) / options.cell_px,
                  static_cast<int>(feature.pixel.y) / options.cell_px);
    in_faint_half += feature.pixel.x < 160 ? 1 : 0;
  }
  EXPECT_LE(features.size(), cells.size() * static_cast<std::size_t>(options.per_cell));
  EXPECT_GT(cells.size(), 50U);
  EXPECT_GT(in_faint_half, static_cast<int>(features.size()) / 4);
}

TEST(DetectFeatures, FindsNoneWhereThereIsNothing) {
  EXPECT_TRUE(DetectFeatures(cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)), {}).empty());
  EXPECT_TRUE(DetectFeatures(cv::Mat(20, 20, CV_8UC1, cv::Scalar(90)), {}).empty());
}

TEST(MatchTracks, FindsAShiftedPictureAgain) {
  const cv::Mat picture = RandomPicture(360, 240);
  const auto before = DetectFeatures(picture.colRange(0, 320), {});
  const auto now = DetectFeatures(picture.colRange(8, 328), {});
  std::vector<Track> tracks;
  for (const Feature& feature : before)
    tracks.push_back({feature.descriptor, {{0, feature.pixel, {}, {}}}, {}});
  const auto matches = MatchTracks(tracks, now,
                                   [](const Track& track) {
                                     return SearchWindow{{track.seen.back().pixel}, 20.0F};
                                   },
                                   0.0F, {});
  EXPECT_GT(matches.size(), before.size() / 3);
  std::set<int> features;
  std::size_t right = 0;
  for (const TrackMatch& match : matches) {
    const cv::Point2f moved = now[static_cast<std::size_t>(match.feature)].pixel -
                              before[static_cast<std::size_t>(match.track)].pixel;
    right += moved == cv::Point2f(-8.0F, 0.0F) ? 1 : 0;
    EXPECT_TRUE(features.insert(match.feature).second) << "a feature was given to two tracks";
  }
  EXPECT_GT(right, matches.size() * 9 / 10);
}

TEST(MatchTracks, LooksOnlyInsideTheWindow) {
  const auto features = DetectFeatures(RandomPicture(320, 240), {});
  const std::vector<Track> tracks = {
      {features[0].descriptor, {{0, features[0].pixel, {}, {}}}, {}}};
  const auto far_away = [&](const Track& track) {
    return SearchWindow{{track.seen.back().pixel + cv::Point2f(300.0F, 300.0F)}, 20.0F};
  };
  EXPECT_TRUE(MatchTracks(tracks, features, far_away, 100.0F, {}).empty());
}

}  // namespace
}  // namespace beckon
