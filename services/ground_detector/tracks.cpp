#include "services/ground_detector/tracks.hpp"

#include <algorithm>

namespace beckon {
namespace {

// Features by the part of the picture that they are in.
class FeatureBuckets {
 public:
  explicit FeatureBuckets(const std::vector<Feature>& features) : features_(features) {
    for (const Feature& feature : features) {
      columns_ = std::max(columns_, Bucket(feature.pixel.x) + 1);
      rows_ = std::max(rows_, Bucket(feature.pixel.y) + 1);
    }
    buckets_.resize(static_cast<std::size_t>(columns_ * rows_));
    for (std::size_t i = 0; i < features.size(); ++i) {
      buckets_[Index(Bucket(features[i].pixel.x), Bucket(features[i].pixel.y))].push_back(
          static_cast<int>(i));
    }
  }

  template <typename Visit>
  void ForEachWithin(const cv::Point2f& point, float radius, const Visit& visit) const {
    const int left = std::max(Bucket(point.x - radius), 0);
    const int right = std::min(Bucket(point.x + radius), columns_ - 1);
    const int top = std::max(Bucket(point.y - radius), 0);
    const int bottom = std::min(Bucket(point.y + radius), rows_ - 1);
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        for (const int i : buckets_[Index(column, row)]) {
          const cv::Point2f offset = features_[static_cast<std::size_t>(i)].pixel - point;
          if (offset.dot(offset) <= radius * radius) visit(i);
        }
      }
    }
  }

 private:
  static constexpr float kSide = 32.0F;  // pixels
  static int Bucket(float coordinate) { return static_cast<int>(std::floor(coordinate / kSide)); }
  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row * columns_ + column);
  }

  const std::vector<Feature>& features_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::vector<int>> buckets_;
};

struct Candidate {
  float distance;
  TrackMatch match;
};

}  // namespace

std::vector<TrackMatch> MatchTracks(const std::vector<Track>& tracks,
                                    const std::vector<Feature>& features,
                                    const std::function<SearchWindow(const Track&)>& predict,
                                    float certain_radius_px, const TrackerOptions& options) {
  const FeatureBuckets buckets(features);
  std::vector<Candidate> candidates;
  std::vector<int> looked_at(features.size(), -1);
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    const SearchWindow window = predict(tracks[t]);
    float best = options.max_distance;
    float second = 4.0F;
    int best_feature = -1;
    for (const cv::Point2f& point : window.points) {
      buckets.ForEachWithin(point, window.radius_px, [&](int i) {
        if (looked_at[static_cast<std::size_t>(i)] == static_cast<int>(t)) return;
        looked_at[static_cast<std::size_t>(i)] = static_cast<int>(t);
        const float distance = DescriptorDistance(tracks[t].descriptor,
                                                  features[static_cast<std::size_t>(i)].descriptor);
        if (distance < best) {
          second = best_feature < 0 ? second : best;
          best = distance;
          best_feature = i;
        } else {
          second = std::min(second, distance);
        }
      });
    }
    const bool clear =
        window.radius_px <= certain_radius_px || best < options.ratio * options.ratio * second;
    if (best_feature >= 0 && clear) {
      candidates.push_back({best, {static_cast<int>(t), best_feature}});
    }
  }

  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.distance < b.distance; });
  std::vector<bool> taken(features.size(), false);
  std::vector<TrackMatch> matches;
  for (const Candidate& candidate : candidates) {
    const auto feature = static_cast<std::size_t>(candidate.match.feature);
    if (taken[feature]) continue;
    taken[feature] = true;
    matches.push_back(candidate.match);
  }
  return matches;
}

}  // namespace beckon
