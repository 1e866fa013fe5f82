// Where the robot itself is: a particle filter over x, y and heading. Radio says which room, the
// camera says where in it.
//
// Monte Carlo localization (Fox, Burgard, Dellaert and Thrun 1999) with as many particles as the
// spread of the belief needs (KLD sampling, Fox 2001), drawn with low variance, and with particles
// from the measurements themselves mixed in (Mixture MCL, Thrun et al. 2001): proposals that radio
// and the last views make without the filter are given the share that the evidence for them
// deserves against the filter's own belief. That finds the pose at the start and after the robot
// has been carried away, by one and the same rule.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "services/rssi_localizer/floor_grid.hpp"
#include "services/rssi_localizer/pose_proposals.hpp"
#include "services/rssi_localizer/posterior.hpp"
#include "services/rssi_localizer/scan_model.hpp"

namespace beckon {

struct PoseFilterOptions {
  ScanModelOptions scan;
  int min_particles = 600;
  int max_particles = 12000;
  int proposals = 1500;  // places tried each time
  std::uint64_t seed = 1;

  // Noise of the motion, standard deviations.
  double distance_per_m = 0.06;
  double turn_per_rad = 0.05;
  double turn_rad_per_m = 0.04;
  double sideways_per_m = 0.03;

  // Located: for a while, nine tenths of the belief have lain within 0.5 m and 20 degrees of one
  // pose, spread no more than this. No longer located: less than half do, or spread twice as far,
  // or the last views say that it is rather somewhere else.
  double located_sd_m = 0.15;
  double located_sd_rad = 0.07;
};

class RobotPoseFilter {
 public:
  // The grid has to outlive this.
  RobotPoseFilter(const FloorPlan& plan, const FloorGrid& grid, const PoseFilterOptions& options);

  // The robot is about here; is located from now on.
  void StartAt(const Pose2& map_from_robot, double sd_m, double sd_rad);
  // The robot may be anywhere.
  void StartAnywhere();

  // By odometry or what stands for it.
  void Move(const Pose2& old_robot_from_robot);
  // The robot may have moved by about this much without anything having been counted.
  void Disturb(double sd_m, double sd_rad);
  // A scan at the present pose. Used once the robot has moved since the last one that was. Throws
  // std::invalid_argument for one that makes no sense.
  void AddScan(const RangeScan& scan);
  // log p(readings | cell) of readings that have not been used yet.
  void AddRadio(const CellValues& log_likelihood);
  // What radio alone says of where the robot is, per cell; for proposals.
  void SetRadioPosterior(const CellValues& probability) { radio_posterior_ = probability; }

  bool is_located() const { return is_located_; }
  struct Belief {
    Pose2 map_from_robot;  // mean of the most believed cluster
    double share = 0.0;    // of the belief that lies in the cluster
    double sd_m = 0.0;     // spread of the cluster, larger axis
    double sd_rad = 0.0;
  };
  // At the present pose.
  Belief belief() const;
  int particles() const { return static_cast<int>(particles_.size()); }
  // One sentence on why the robot is not located; empty where it is.
  std::string Doubt() const;

 private:
  void MoveParticles();
  void Weigh(const ScanModel::View& view, double share);
  double LogEvidence(std::size_t views);
  void MixProposals();
  void Resample();
  void UpdateBelief();
  void Judge(double views);
  void LoseItself();
  int RadioCell(const Eigen::Vector2d& point) const;
  int NeededParticles(const std::vector<double>& weights) const;
  std::vector<double> Weights() const;

  PoseFilterOptions options_;
  const FloorGrid& grid_;
  ScanModel scan_model_;
  std::vector<int> radio_cell_;  // per cell of the grid's geometry: the free cell nearest to it
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;

  std::vector<Particle> particles_;
  CellValues radio_posterior_;
  RecentViews recent_;
  Pose2 pending_;                 // motion since the particles were last moved
  double pending_m_ = 0.0;        // its length along the way
  double pending_rad_ = 0.0;      // and how far it turned
  double since_proposals_ = 0.0;  // views' worth of motion
  bool has_seen_ = false;
  Belief belief_;  // where the particles are
  bool is_located_ = false;
  double agreed_ = 0.0;  // views' worth of motion for which the belief has been narrow
};

}  // namespace beckon
