#include "services/rssi_localizer/robot_pose_filter.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <unordered_set>

#include "common/text.hpp"

namespace beckon {
namespace {

// After kNewViewM or kNewViewRad a scan counts in full. Scans that would count less are left out.
constexpr double kLeastShare = 0.25;

constexpr std::size_t kViewsAtMost = 24;
constexpr std::size_t kViewsWhileLocated = 5;
// Prior chance, each time that proposals are made, that the robot is not where the filter thinks:
// it has been carried away; or, before it is located, no particle has been near enough to the
// truth.
constexpr double kCarriedAway = 1e-3;
constexpr double kMissed = 0.05;
constexpr double kMostProposed = 0.3;

// Wheels slip: some particles take the counted motion for much less certain.
constexpr double kSlipChance = 0.03;
constexpr double kSlipFactor = 6.0;
constexpr double kInWallLog = -8.0;

// Fox 2001: with the chance of kQuantile (as standard deviations) the error against the true belief
// stays below kKldError.
constexpr double kKldError = 0.05;
constexpr double kQuantile = 2.33;
constexpr double kBinM = 0.2;
constexpr double kBinRad = 0.175;

constexpr double kClusterM = 0.5;
constexpr double kClusterRad = 0.35;
constexpr double kLocatedShare = 0.9;
constexpr double kLostShare = 0.5;
constexpr double kAgreeViews = 5.0;
constexpr int kEvidenceParticles = 40;

std::int64_t BinOf(const Pose2& pose, double side_m, double side_rad) {
  const auto x = static_cast<std::int64_t>(std::floor(pose.x / side_m));
  const auto y = static_cast<std::int64_t>(std::floor(pose.y / side_m));
  const auto turn = static_cast<std::int64_t>(std::floor(pose.theta / side_rad));
  return (x * 1'000'003 + y) * 1'009 + turn;
}

bool IsNear(const Pose2& a, const Pose2& b) {
  return (a.translation() - b.translation()).squaredNorm() < kClusterM * kClusterM &&
         std::abs(WrapAngle(a.theta - b.theta)) < kClusterRad;
}

// Per cell of the geometry the free cell that is the fewest steps away.
std::vector<int> NearestFreeCells(const FloorGrid& grid) {
  const GridGeometry& geometry = grid.geometry();
  std::vector<int> nearest(static_cast<std::size_t>(geometry.size()), -1);
  std::vector<int> queue;
  for (int cell = 0; cell < grid.size(); ++cell) {
    queue.push_back(grid.geometry_index()[static_cast<std::size_t>(cell)]);
    nearest[static_cast<std::size_t>(queue.back())] = cell;
  }
  constexpr int kSteps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const int column = queue[next] % geometry.width;
    const int row = queue[next] / geometry.width;
    for (const auto& step : kSteps) {
      if (!geometry.Contains(column + step[0], row + step[1])) continue;
      const int index = geometry.Index(column + step[0], row + step[1]);
      if (nearest[static_cast<std::size_t>(index)] >= 0) continue;
      nearest[static_cast<std::size_t>(index)] = nearest[static_cast<std::size_t>(queue[next])];
      queue.push_back(index);
    }
  }
  return nearest;
}

}  // namespace

RobotPoseFilter::RobotPoseFilter(const FloorPlan& plan, const FloorGrid& grid,
                                 const PoseFilterOptions& options)
    : options_(options),
      grid_(grid),
      scan_model_(plan, options.scan),
      radio_cell_(NearestFreeCells(grid)),
      random_(options.seed),
      recent_(kViewsAtMost) {
  StartAnywhere();
}

void RobotPoseFilter::StartAt(const Pose2& map_from_robot, double sd_m, double sd_rad) {
  particles_.clear();
  for (int i = 0; i < options_.min_particles; ++i) {
    particles_.push_back(
        {{map_from_robot.x + sd_m * normal_(random_), map_from_robot.y + sd_m * normal_(random_),
          WrapAngle(map_from_robot.theta + sd_rad * normal_(random_))},
         1.0 / options_.min_particles});
  }
  recent_.KeepNewest(0);
  has_seen_ = false;
  pending_ = {};
  pending_m_ = pending_rad_ = 0.0;
  UpdateBelief();
  is_located_ = true;
}

void RobotPoseFilter::StartAnywhere() {
  const PoseSampler sampler(grid_, radio_posterior_);
  particles_.clear();
  for (int i = 0; i < options_.max_particles; ++i) {
    particles_.push_back({sampler.Draw(random_), 1.0 / options_.max_particles});
  }
  is_located_ = false;
  has_seen_ = false;
  agreed_ = 0.0;
  UpdateBelief();
}

void RobotPoseFilter::Move(const Pose2& old_robot_from_robot) {
  pending_ = pending_ * old_robot_from_robot;
  pending_m_ += old_robot_from_robot.translation().norm();
  pending_rad_ += std::abs(old_robot_from_robot.theta);
  recent_.Move(old_robot_from_robot);
}

void RobotPoseFilter::Disturb(double sd_m, double sd_rad) {
  for (Particle& particle : particles_) {
    Pose2& pose = particle.map_from_robot;
    pose = {pose.x + sd_m * normal_(random_), pose.y + sd_m * normal_(random_),
            WrapAngle(pose.theta + sd_rad * normal_(random_))};
  }
  recent_.KeepNewest(0);
  UpdateBelief();
}

void RobotPoseFilter::MoveParticles() {
  const double sd_ahead = options_.distance_per_m * pending_m_;
  const double sd_aside = options_.sideways_per_m * pending_m_;
  const double sd_turn =
      std::hypot(options_.turn_per_rad * pending_rad_, options_.turn_rad_per_m * pending_m_);
  std::uniform_real_distribution<double> uniform;
  for (Particle& particle : particles_) {
    const double factor = uniform(random_) < kSlipChance ? kSlipFactor : 1.0;
    const Pose2 error{factor * sd_ahead * normal_(random_), factor * sd_aside * normal_(random_),
                      factor * sd_turn * normal_(random_)};
    particle.map_from_robot = particle.map_from_robot * pending_ * error;
  }
  belief_.map_from_robot = belief_.map_from_robot * pending_;
  pending_ = {};
  pending_m_ = pending_rad_ = 0.0;
}

void RobotPoseFilter::AddScan(const RangeScan& scan) {
  const ScanModel::View view = scan_model_.Prepare(scan);
  const double moved = pending_m_ / kNewViewM + pending_rad_ / kNewViewRad;
  const double share = has_seen_ ? std::min(1.0, moved) : 1.0;
  if (share < kLeastShare || view.empty() || !scan_model_.field().has_walls()) return;
  has_seen_ = true;
  since_proposals_ += moved;
  recent_.Add(view);
  MoveParticles();
  Weigh(view, share);
  if (since_proposals_ >= 1.0) MixProposals();
  Resample();
  UpdateBelief();
  Judge(share);
}

void RobotPoseFilter::Weigh(const ScanModel::View& view, double share) {
  std::vector<double> log_weights;
  for (const Particle& particle : particles_) {
    const Pose2& pose = particle.map_from_robot;
    const double in_wall = scan_model_.field().IsFree(pose.translation()) ? 0.0 : kInWallLog;
    log_weights.push_back(share * (scan_model_.LogLikelihood(view, pose) + in_wall));
  }
  const double most = *std::max_element(log_weights.begin(), log_weights.end());
  double sum = 0.0;
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    particles_[i].weight *= std::exp(log_weights[i] - most);
    sum += particles_[i].weight;
  }
  for (Particle& particle : particles_) particle.weight /= sum;
}

void RobotPoseFilter::AddRadio(const CellValues& log_likelihood) {
  MoveParticles();
  double sum = 0.0;
  const float most = *std::max_element(log_likelihood.begin(), log_likelihood.end());
  for (Particle& particle : particles_) {
    const int cell = RadioCell(particle.map_from_robot.translation());
    particle.weight *=
        std::exp(static_cast<double>(log_likelihood[static_cast<std::size_t>(cell)] - most));
    sum += particle.weight;
  }
  for (Particle& particle : particles_) {
    particle.weight = sum > 0.0 ? particle.weight / sum : 1.0 / particles();
  }
  UpdateBelief();
}

int RobotPoseFilter::RadioCell(const Eigen::Vector2d& point) const {
  const GridGeometry& geometry = grid_.geometry();
  const int column = std::clamp(geometry.Column(point.x()), 0, geometry.width - 1);
  const int row = std::clamp(geometry.Row(point.y()), 0, geometry.height - 1);
  return radio_cell_[static_cast<std::size_t>(geometry.Index(column, row))];
}

// log p(the newest views | what the filter believes), over some of the particles.
double RobotPoseFilter::LogEvidence(std::size_t views) {
  double sum = 0.0;
  double most = -std::numeric_limits<double>::infinity();
  for (const std::size_t i : SystematicDraw(Weights(), kEvidenceParticles, random_)) {
    const double here = recent_.LogLikelihood(scan_model_, particles_[i].map_from_robot, views);
    sum = here > most ? sum * std::exp(most - here) + 1.0 : sum + std::exp(here - most);
    most = std::max(most, here);
  }
  return most + std::log(sum / kEvidenceParticles);
}

void RobotPoseFilter::MixProposals() {
  since_proposals_ = 0.0;
  const std::size_t views = is_located_ ? kViewsWhileLocated : kViewsAtMost;
  Proposals proposals = ProposePoses(grid_, radio_posterior_, scan_model_, recent_, views,
                                     options_.proposals, random_);
  if (proposals.particles.empty()) return;
  const double own = LogEvidence(views);
  const double ratio = (is_located_ ? kCarriedAway : kMissed) *
                       std::exp(std::min(50.0, proposals.log_evidence - own));
  const double share = std::min(kMostProposed, ratio / (1.0 + ratio));
  if (ratio > 1.0) LoseItself();
  for (Particle& particle : particles_) particle.weight *= 1.0 - share;
  for (Particle& proposed : proposals.particles) {
    proposed.weight *= share;
    particles_.push_back(proposed);
  }
}

std::vector<double> RobotPoseFilter::Weights() const {
  std::vector<double> weights;
  for (const Particle& particle : particles_) weights.push_back(particle.weight);
  return weights;
}

int RobotPoseFilter::NeededParticles(const std::vector<double>& weights) const {
  // As many of a draw's bins as there are, which a draw of the largest set shows well enough.
  std::unordered_set<std::int64_t> bins;
  std::mt19937_64 random(options_.seed);
  for (const std::size_t drawn : SystematicDraw(weights, options_.max_particles, random)) {
    bins.insert(BinOf(particles_[drawn].map_from_robot, kBinM, kBinRad));
  }
  const auto degrees = static_cast<double>(bins.size()) - 1.0;
  if (degrees < 1.0) return options_.min_particles;
  const double part = 2.0 / (9.0 * degrees);
  const double needed =
      degrees / (2.0 * kKldError) * std::pow(1.0 - part + std::sqrt(part) * kQuantile, 3);
  return std::clamp(static_cast<int>(std::min(needed, 1e9)), options_.min_particles,
                    options_.max_particles);
}

void RobotPoseFilter::Resample() {
  const std::vector<double> weights = Weights();
  double squares = 0.0;
  for (const double weight : weights) squares += weight * weight;
  const int needed = NeededParticles(weights);
  if (1.0 / squares > 0.5 * static_cast<double>(weights.size()) && particles() < 2 * needed) return;
  std::vector<Particle> drawn;
  for (const std::size_t i : SystematicDraw(weights, needed, random_)) {
    drawn.push_back({particles_[i].map_from_robot, 1.0 / needed});
  }
  particles_ = std::move(drawn);
}

void RobotPoseFilter::UpdateBelief() {
  // The heaviest coarse bin, and from there the mean of what lies around, until it stays.
  std::unordered_map<std::int64_t, double> bins;
  std::int64_t heaviest = 0;
  double most = -1.0;
  for (const Particle& particle : particles_) {
    const std::int64_t bin = BinOf(particle.map_from_robot, kClusterM, kClusterRad);
    const double sum = bins[bin] += particle.weight;
    if (sum > most) {
      most = sum;
      heaviest = bin;
    }
  }
  Pose2 mean;
  double share = 0.0;
  const auto add_up = [&](const auto& belongs) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    share = 0.0;
    for (const auto& particle : particles_) {
      const Pose2& pose = particle.map_from_robot;
      if (!belongs(pose)) continue;
      sum += particle.weight *
             Eigen::Vector4d(pose.x, pose.y, std::cos(pose.theta), std::sin(pose.theta));
      share += particle.weight;
    }
    mean = {sum[0] / share, sum[1] / share, std::atan2(sum[3], sum[2])};
  };
  add_up([&](const Pose2& pose) { return BinOf(pose, kClusterM, kClusterRad) == heaviest; });
  for (int i = 0; i < 3; ++i) {
    const Pose2 around = mean;
    add_up([&](const Pose2& pose) { return IsNear(pose, around); });
    if (share <= 0.0) break;
  }
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  double turn = 0.0;
  for (const Particle& particle : particles_) {
    const Pose2& pose = particle.map_from_robot;
    if (!IsNear(pose, mean)) continue;
    const Eigen::Vector2d offset = pose.translation() - mean.translation();
    const double angle = WrapAngle(pose.theta - mean.theta);
    scatter += particle.weight / share * offset * offset.transpose();
    turn += particle.weight / share * angle * angle;
  }
  const double widest =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter).eigenvalues().maxCoeff();
  belief_ = {mean, share, std::sqrt(std::max(0.0, widest)), std::sqrt(turn)};
}

// After an update that was worth so many views.
void RobotPoseFilter::Judge(double views) {
  const bool is_narrow = belief_.share > kLocatedShare && belief_.sd_m < options_.located_sd_m &&
                         belief_.sd_rad < options_.located_sd_rad;
  agreed_ = is_narrow ? agreed_ + views : 0.0;
  if (agreed_ >= kAgreeViews) is_located_ = true;
  const bool is_lost = belief_.share < kLostShare || belief_.sd_m > 2.0 * options_.located_sd_m ||
                       belief_.sd_rad > 2.0 * options_.located_sd_rad;
  if (is_lost) LoseItself();
}

void RobotPoseFilter::LoseItself() {
  agreed_ = 0.0;
  if (!is_located_) return;
  is_located_ = false;
  // Older views may be of where it was carried from.
  recent_.KeepNewest(kViewsWhileLocated / 2);
}

RobotPoseFilter::Belief RobotPoseFilter::belief() const {
  Belief now = belief_;
  now.map_from_robot = belief_.map_from_robot * pending_;
  return now;
}

std::string RobotPoseFilter::Doubt() const {
  if (is_located_) return "";
  if (!scan_model_.field().has_walls()) return "the floor plan has no walls to find itself by";
  if (!has_seen_) return "the robot has not seen anything yet";
  return Format("the robot is looking for itself: %.0f %% for the likeliest pose",
                100.0 * belief_.share);
}

}  // namespace beckon
