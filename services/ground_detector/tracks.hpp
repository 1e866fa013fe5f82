// Features followed through the frames of the last second.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/clock.hpp"
#include "common/frames.hpp"
#include "services/ground_detector/features.hpp"

namespace beckon {

enum class FeatureClass : std::uint8_t { kUndetermined = 0, kGround = 1, kNotGround = 2 };

struct Observation {
  Utime utime = 0;  // of the frame
  cv::Point2f pixel;
  // Where it was seen from, and where it lies if it is ground (m, odometry frame); nothing at and
  // above the horizon.
  Pose2 odometry_from_robot;
  std::optional<Eigen::Vector2d> point;
};

struct Track {
  SurfDescriptor descriptor{};   // as seen last
  std::deque<Observation> seen;  // oldest first, at most one for each frame that is kept
  FeatureClass feature_class = FeatureClass::kUndetermined;
};

struct TrackerOptions {
  float max_distance = 0.25F;  // squared distance of descriptors
  float ratio = 0.8F;          // the best has to be this much closer than the second best
};

// Where a track may be in the new frame: within `radius_px` of any of the points.
struct SearchWindow {
  std::vector<cv::Point2f> points;
  float radius_px = 0.0F;
};

// Which feature of the new frame shows which track.
struct TrackMatch {
  int track = 0;
  int feature = 0;
};

// One feature for each track at most, and the other way round; the closest descriptors win. A
// window of no more than `certain_radius_px` needs no second-best test: motion has told what is
// meant, and a floor of equal tiles would fail that test everywhere.
std::vector<TrackMatch> MatchTracks(const std::vector<Track>& tracks,
                                    const std::vector<Feature>& features,
                                    const std::function<SearchWindow(const Track&)>& predict,
                                    float certain_radius_px, const TrackerOptions& options);

}  // namespace beckon
