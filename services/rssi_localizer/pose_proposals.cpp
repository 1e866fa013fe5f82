#include "services/rssi_localizer/pose_proposals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace beckon {
namespace {

// A tenth of the places that radio thinks impossible are tried all the same.
constexpr double kAnywhere = 0.1;
constexpr double kSoft = 0.25;
constexpr double kJitterM = 0.15;
constexpr double kJitterRad = 0.09;
constexpr int kSurvivors = 4;  // one in so many goes on to the sharp step

// Weights from log weights; returns the log of their mean before.
double Normalise(std::vector<double>& log_weights) {
  const double most = *std::max_element(log_weights.begin(), log_weights.end());
  double sum = 0.0;
  for (double& weight : log_weights) {
    weight = std::exp(weight - most);
    sum += weight;
  }
  for (double& weight : log_weights) weight /= sum;
  return most + std::log(sum / static_cast<double>(log_weights.size()));
}

}  // namespace

void RecentViews::Move(const Pose2& old_robot_from_robot) {
  const Pose2 robot_from_old = old_robot_from_robot.Inverse();
  for (Entry& entry : views_) entry.robot_from_then = robot_from_old * entry.robot_from_then;
}

void RecentViews::Add(const ScanModel::View& view) {
  if (!views_.empty()) {
    const Pose2& last = views_.back().robot_from_then;
    if (last.translation().norm() < kNewViewM && std::abs(last.theta) < kNewViewRad) return;
  }
  views_.push_back({Pose2{}, view});
  if (views_.size() > most_) views_.pop_front();
}

void RecentViews::KeepNewest(std::size_t count) {
  while (views_.size() > count) views_.pop_front();
}

double RecentViews::LogLikelihood(const ScanModel& model, const Pose2& map_from_robot,
                                  std::size_t count) const {
  double sum = 0.0;
  for (std::size_t i = views_.size() - std::min(count, views_.size()); i < views_.size(); ++i) {
    sum += model.LogLikelihood(views_[i].view, map_from_robot * views_[i].robot_from_then);
  }
  return sum;
}

PoseSampler::PoseSampler(const FloorGrid& grid, const CellValues& probability) : grid_(grid) {
  const auto cells = static_cast<std::size_t>(grid.size());
  double sum = 0.0;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const double even = 1.0 / static_cast<double>(cells);
    sum += probability.empty()
               ? even
               : (1.0 - kAnywhere) * static_cast<double>(probability[cell]) + kAnywhere * even;
    sums_.push_back(sum);
  }
}

Pose2 PoseSampler::Draw(std::mt19937_64& random) const {
  std::uniform_real_distribution<double> uniform;
  const auto drawn = std::upper_bound(sums_.begin(), sums_.end(), uniform(random) * sums_.back());
  const auto cell =
      std::min(static_cast<std::size_t>(drawn - sums_.begin()), grid_.centres().size() - 1);
  const double side = grid_.geometry().resolution_m;
  const double x = grid_.centres()[cell].x() + side * (uniform(random) - 0.5);
  const double y = grid_.centres()[cell].y() + side * (uniform(random) - 0.5);
  return {x, y, std::numbers::pi * (2.0 * uniform(random) - 1.0)};
}

std::vector<std::size_t> SystematicDraw(const std::vector<double>& weights, int count,
                                        std::mt19937_64& random) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double step = total / count;
  double pointer = std::uniform_real_distribution<double>()(random) * step;
  std::vector<std::size_t> drawn;
  double sum = weights[0];
  std::size_t at = 0;
  for (int i = 0; i < count; ++i, pointer += step) {
    while (sum <= pointer && at + 1 < weights.size()) sum += weights[++at];
    drawn.push_back(at);
  }
  return drawn;
}

Proposals ProposePoses(const FloorGrid& grid, const CellValues& radio_posterior,
                       const ScanModel& model, const RecentViews& recent, std::size_t views,
                       int count, std::mt19937_64& random) {
  const PoseSampler sampler(grid, radio_posterior);
  std::vector<Pose2> poses;
  std::vector<double> weights;
  for (int i = 0; i < count; ++i) {
    poses.push_back(sampler.Draw(random));
    const bool is_free = model.field().IsFree(poses.back().translation());
    weights.push_back(is_free ? kSoft * recent.LogLikelihood(model, poses.back(), views)
                              : -std::numeric_limits<double>::infinity());
  }
  Proposals proposals;
  if (*std::max_element(weights.begin(), weights.end()) ==
      -std::numeric_limits<double>::infinity()) {
    proposals.log_evidence = -std::numeric_limits<double>::infinity();
    return proposals;
  }
  // The evidence is the product of the means of both steps.
  proposals.log_evidence = Normalise(weights);

  std::normal_distribution<double> normal;
  std::vector<double> sharp;
  for (const std::size_t drawn : SystematicDraw(weights, count / kSurvivors, random)) {
    Pose2 pose = poses[drawn];
    const double before = recent.LogLikelihood(model, pose, views);
    const Pose2 moved{pose.x + kJitterM * normal(random), pose.y + kJitterM * normal(random),
                      WrapAngle(pose.theta + kJitterRad * normal(random))};
    double after = before;
    if (model.field().IsFree(moved.translation())) {
      // A step of Metropolis that keeps the soft distribution.
      const double there = recent.LogLikelihood(model, moved, views);
      const double chance = std::exp(std::min(0.0, kSoft * (there - before)));
      if (std::uniform_real_distribution<double>()(random) < chance) {
        pose = moved;
        after = there;
      }
    }
    proposals.particles.push_back({pose, 0.0});
    sharp.push_back((1.0 - kSoft) * after);
  }
  proposals.log_evidence += Normalise(sharp);
  for (std::size_t i = 0; i < sharp.size(); ++i) proposals.particles[i].weight = sharp[i];
  return proposals;
}

}  // namespace beckon
