// Who was seen to move of late.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace beckon {

// A walker gives each cell of GRID one hit or two before he is elsewhere, and leaves no trace
// there. Where two scans in a row show something on floor that was free a moment before, somebody
// moves; he is remembered for some seconds after he was seen last, as he may go on beside the
// robot, out of its sight.
class Movers {
 public:
  // `suspects`: where a new scan shows something that was not there a second ago, local frame, m.
  void Add(double now_s, std::vector<Eigen::Vector2d> suspects);
  // From a point to the nearest place where somebody was seen, m; inf where nobody was of late.
  double Nearest(double now_s, const Eigen::Vector2d& point) const;
  void Clear();

 private:
  struct Mover {
    Eigen::Vector2d at;
    double until_s;
  };
  std::vector<Mover> movers_;
  std::vector<Eigen::Vector2d> suspects_;  // of the last scan
};

}  // namespace beckon
