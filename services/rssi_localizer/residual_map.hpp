// What a place does to the signal of one beacon beyond distance and walls: a Gaussian process over
// the floor that is learnt where calibration readings lie densely enough, and returns to zero
// elsewhere.
//
// After Ferris, Haehnel, Fox: "Gaussian processes for signal strength-based location estimation",
// RSS 2006.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <span>
#include <vector>

namespace beckon {

struct Residual {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  // m, map frame
  double residual_db = 0.0;                            // measured minus expected RSSI
};

// Covariance amplitude_db^2 exp(-distance / length_m) between two places, plus noise of each
// reading. Readings in one bin share what they have in common, so a bin counts as at most four
// readings.
struct ResidualKernel {
  double amplitude_db = 4.0;
  double length_m = 2.0;
  double noise_db = 5.0;
};

class ResidualMap {
 public:
  struct Value {
    double mean_db = 0.0;
    double variance_db2 = 0.0;  // of the mean: what is not known about this place
  };

  // Making a map takes the cube of its bins, and looking up a place the square.
  static constexpr std::size_t kMaxBins = 400;

  // Residuals of one beacon, binned (0.5 m, larger where there would be more than max_bins).
  ResidualMap(std::span<const Residual> residuals, const ResidualKernel& kernel,
              std::size_t max_bins = kMaxBins);

  Value At(const Eigen::Vector2d& position) const;
  // The same at many places, some times faster.
  std::vector<Value> At(std::span<const Eigen::Vector2d> positions) const;

  // For each residual given: the map's value there, had nothing been measured in its bin.
  const std::vector<Value>& left_out() const { return left_out_; }
  // Predicting each bin's mean from all others: sums over bins of the log variance (dB^2) and of
  // the squared error over the variance.
  double left_out_log_variance() const { return left_out_log_variance_; }
  double left_out_squares() const { return left_out_squares_; }
  int bins() const { return static_cast<int>(places_.size()); }

 private:
  double Covariance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;

  ResidualKernel kernel_;
  std::vector<Eigen::Vector2d> places_;
  Eigen::VectorXd weights_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  std::vector<Value> left_out_;
  double left_out_log_variance_ = 0.0;
  double left_out_squares_ = 0.0;
};

// The kernel under which all beacons' maps together predict left-out bins best. Amplitude and noise
// together make at least sd_db, the spread of the residuals.
ResidualKernel FitResidualKernel(const std::vector<std::vector<Residual>>& by_beacon, double sd_db);

}  // namespace beckon
