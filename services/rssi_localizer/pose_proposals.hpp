// Where else the robot might be: poses that the radio allows and the last views fit, found without
// knowing where the robot was before.
#pragma once

#include <deque>
#include <random>
#include <vector>

#include "services/rssi_localizer/floor_grid.hpp"
#include "services/rssi_localizer/posterior.hpp"
#include "services/rssi_localizer/scan_model.hpp"

namespace beckon {

struct Particle {
  Pose2 map_from_robot;
  double weight = 0.0;
};

// Motion after which the camera shows other things.
inline constexpr double kNewViewM = 0.3;
inline constexpr double kNewViewRad = 0.35;

// What the camera saw on the last few metres, each view with the pose from which it was taken.
class RecentViews {
 public:
  explicit RecentViews(std::size_t most) : most_(most) {}

  // The robot has moved.
  void Move(const Pose2& old_robot_from_robot);
  // Takes the view if it is far enough from the last one to tell something new.
  void Add(const ScanModel::View& view);
  void KeepNewest(std::size_t count);

  std::size_t size() const { return views_.size(); }
  // log p(the newest `count` views | the robot is here now).
  double LogLikelihood(const ScanModel& model, const Pose2& map_from_robot,
                       std::size_t count) const;

 private:
  struct Entry {
    Pose2 robot_from_then;
    ScanModel::View view;
  };
  std::size_t most_;
  std::deque<Entry> views_;
};

// Draws places from the radio posterior (per cell of `grid`; empty: anywhere on it) with any
// heading, weighs them by the newest `views` views in two steps, a soft one and a sharp one with
// the survivors moved a little in between (annealed importance sampling), and returns `count` of
// them with weights that sum to one. `log_evidence`: log of the mean likelihood of these views over
// all the places drawn, for comparison with that of a pose that is believed in.
struct Proposals {
  std::vector<Particle> particles;
  double log_evidence = 0.0;
};
Proposals ProposePoses(const FloorGrid& grid, const CellValues& radio_posterior,
                       const ScanModel& model, const RecentViews& recent, std::size_t views,
                       int count, std::mt19937_64& random);

// Pose anywhere in the cells of the grid with these probabilities; empty: all alike.
class PoseSampler {
 public:
  PoseSampler(const FloorGrid& grid, const CellValues& probability);
  Pose2 Draw(std::mt19937_64& random) const;

 private:
  const FloorGrid& grid_;
  std::vector<double> sums_;  // of the probabilities up to each cell
};

// Number of each of `count` particles drawn with the given weights: one random number, evenly
// spaced pointers (Kitagawa 1996).
std::vector<std::size_t> SystematicDraw(const std::vector<double>& weights, int count,
                                        std::mt19937_64& random);

}  // namespace beckon
