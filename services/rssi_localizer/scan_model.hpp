// How likely a virtual scan is, for a robot at a pose on the floor plan.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/frames.hpp"
#include "services/rssi_localizer/plan_field.hpp"

namespace beckon {

// Ray i at bearing first + i * step, from the origin of the robot frame, counter-clockwise from x.
struct RangeScan {
  double first_bearing_rad = 0.0;
  double bearing_step_rad = 0.0;
  std::vector<float> ranges_m;       // inf: nothing within the visible ground; NaN: undetermined
  std::vector<float> ground_seen_m;  // how far ground was seen without a break
};

// The beam model of Thrun, Burgard and Fox (Probabilistic Robotics, chapter 6.3), for a plan that
// knows walls but neither furniture nor people: what is nearer than the plan's wall is common, what
// is seen through a wall hardly ever happens.
struct ScanModelOptions {
  int rays = 24;              // of each scan, spread evenly; neighbours say the same
  double max_range_m = 10.0;  // farther walls are not asked for
  double wall_sd_m = 0.10;    // of a wall's place: plan, foot of the wall in the picture, cells
  double wall_sd_per_m = 0.03;
  double unmapped = 0.5;         // share of rays that end at something that is not on the plan,
  double unmapped_mean_m = 1.5;  // on average so far away where no wall is before it
  double through_wall = 0.03;    // share of rays that go on behind a wall of the plan
  // Rays meet the same things: as much as all of them together count. 1 = independent.
  double trust = 0.12;
};

class ScanModel {
 public:
  ScanModel(const FloorPlan& plan, const ScanModelOptions& options);

  const PlanField& field() const { return field_; }
  const ScanModelOptions& options() const { return options_; }

  // The rays of a scan that say anything, each with its log-likelihood over the distance of the
  // wall behind it.
  class View {
   public:
    bool empty() const { return rays_.empty(); }

   private:
    friend class ScanModel;
    struct Ray {
      Eigen::Vector2f direction;          // robot frame
      float longest_m;                    // a wall beyond this makes no difference
      std::vector<float> log_likelihood;  // per bin of the wall's distance; the last: no wall
    };
    std::vector<Ray> rays_;
  };
  // Throws std::invalid_argument for a scan whose numbers do not fit together.
  View Prepare(const RangeScan& scan) const;

  // log p(scan | pose), up to a constant of the scan, already weighted with `trust`.
  double LogLikelihood(const View& view, const Pose2& map_from_robot) const;

 private:
  double RayLikelihood(double range_m, double seen_m, double wall_m) const;

  ScanModelOptions options_;
  PlanField field_;
};

}  // namespace beckon
