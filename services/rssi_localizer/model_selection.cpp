#include "services/rssi_localizer/model_selection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace beckon {
namespace {

constexpr int kFolds = 5;
constexpr double kSquareM = 1.0;
constexpr std::size_t kMaxJudgedEpochs = 250;
constexpr int kMaxCells = 1500;      // judging needs no fine grid
constexpr double kLeastGain = 0.01;  // of the log score per epoch
constexpr int kAll = Trust{}.strongest;
constexpr std::array<double, 10> kTempers = {0.1, 0.15, 0.25, 0.35, 0.5, 0.65, 0.8, 1.0, 1.25, 1.5};

// Fold of each epoch; empty where there are too few places.
std::vector<int> Folds(const CalibrationSet& calibration) {
  std::map<std::pair<long, long>, int> fold_of;
  const auto square = [](const Eigen::Vector2d& position) {
    return std::pair(std::lround(std::floor(position.x() / kSquareM)),
                     std::lround(std::floor(position.y() / kSquareM)));
  };
  for (const CalibrationEpoch& epoch : calibration.epochs) fold_of[square(epoch.position)] = 0;
  if (fold_of.size() < 3) return {};
  int number = 0;
  for (auto& [at, fold] : fold_of) {
    // A lattice in which a square's neighbours belong to other folds, or one after the other where
    // each fold holds only a place or two.
    const long lattice = ((at.first + 2 * at.second) % kFolds + kFolds) % kFolds;
    fold = fold_of.size() <= 2 * kFolds ? number % kFolds : static_cast<int>(lattice);
    ++number;
  }
  std::vector<int> folds;
  for (const CalibrationEpoch& epoch : calibration.epochs) {
    folds.push_back(fold_of[square(epoch.position)]);
  }
  return folds;
}

struct Judgement {
  double log_score = -std::numeric_limits<double>::infinity();
  double error_m = 0.0;
  Trust trust;
  int epochs = 0;
};

class Judge {
 public:
  Judge(const Site& site, const CalibrationSet& calibration, const PathLoss& prior,
        std::vector<int> folds)
      : site_(site),
        calibration_(calibration),
        prior_(prior),
        folds_(std::move(folds)),
        grid_(site.plan, {.resolution_m = 0.25, .max_cells = kMaxCells}, Walked(calibration)) {}

  // The best of kTempers x `strongest` for a model of these parts.
  Judgement Of(const ModelParts& parts, const std::vector<int>& strongest) {
    // Its three numbers may well come from all readings: what is held back is what they say of a
    // place.
    if (parts.residual_map && !kernel_) {
      kernel_ = BuildFittedModel(grid_, site_, calibration_, parts, prior_).kernel;
    }
    std::vector<Judgement> judgements;
    for (const int most : strongest) {
      for (const double temper : kTempers) {
        judgements.push_back({0.0, 0.0, {temper, most}, 0});
      }
    }
    const std::size_t stride =
        std::max<std::size_t>(1, calibration_.epochs.size() / kMaxJudgedEpochs);
    for (int fold = 0; fold < kFolds; ++fold) {
      std::vector<char> keep(folds_.size());
      for (std::size_t i = 0; i < folds_.size(); ++i) keep[i] = folds_[i] != fold ? 1 : 0;
      const FittedModel fitted =
          BuildFittedModel(grid_, site_, calibration_.Keeping(keep), parts, prior_, kernel_);
      for (std::size_t i = 0; i < folds_.size(); i += stride) {
        if (folds_[i] == fold) AddEpoch(fitted.model, calibration_.epochs[i], judgements);
      }
    }
    Judgement best;
    for (Judgement& judgement : judgements) {
      judgement.log_score /= std::max(1, judgement.epochs);
      judgement.error_m /= std::max(1, judgement.epochs);
      if (judgement.log_score > best.log_score) best = judgement;
    }
    return best;
  }

  const std::optional<ResidualKernel>& kernel() const { return kernel_; }

 private:
  static std::vector<Eigen::Vector2d> Walked(const CalibrationSet& calibration) {
    std::vector<Eigen::Vector2d> walked;
    for (const CalibrationEpoch& epoch : calibration.epochs) walked.push_back(epoch.position);
    return walked;
  }

  void AddEpoch(const MeasurementModel& model, const CalibrationEpoch& epoch,
                std::vector<Judgement>& judgements) const {
    const auto truth = static_cast<std::size_t>(grid_.NearestCell(epoch.position));
    int strongest = -1;
    CellValues untempered;
    for (Judgement& judgement : judgements) {
      if (judgement.trust.strongest != strongest) {
        strongest = judgement.trust.strongest;
        untempered = LogLikelihood(model, epoch.heard, {1.0, strongest}, grid_.size());
      }
      CellValues probability = untempered;
      for (float& value : probability) value *= static_cast<float>(judgement.trust.temper);
      NormaliseLog(probability);
      Eigen::Vector2d mean = Eigen::Vector2d::Zero();
      for (std::size_t cell = 0; cell < probability.size(); ++cell) {
        mean += static_cast<double>(probability[cell]) * grid_.centres()[cell];
      }
      // One moment in twenty may be hopeless (a crowd passes); it must not decide for all others.
      constexpr double kHopeless = 0.05;
      const double density = static_cast<double>(probability[truth]) / grid_.cell_area_m2();
      const double even = 1.0 / (grid_.size() * grid_.cell_area_m2());
      judgement.log_score += std::log((1.0 - kHopeless) * density + kHopeless * even);
      judgement.error_m += (mean - epoch.position).norm();
      ++judgement.epochs;
    }
  }

  const Site& site_;
  const CalibrationSet& calibration_;
  const PathLoss& prior_;
  std::vector<int> folds_;
  FloorGrid grid_;
  std::optional<ResidualKernel> kernel_;
};

}  // namespace

std::string ModelChoice::Describe() const {
  char text[160];
  std::snprintf(text, sizeof text, ", temper %.2f", trust.temper);
  std::string description = parts.Describe() + text;
  if (trust.strongest < kAll) {
    description += ", the " + std::to_string(trust.strongest) + " strongest readings";
  }
  if (held_back_epochs > 0) {
    std::snprintf(text, sizeof text, " (%d held-back epochs: mean error %.2f m, log score %.3f)",
                  held_back_epochs, held_back_error_m, held_back_log_score);
    description += text;
  }
  return description;
}

ModelChoice ChooseModel(const Site& site, const CalibrationSet& calibration,
                        const PathLoss& prior) {
  ModelChoice choice;
  std::vector<int> folds = Folds(calibration);
  if (folds.empty()) return choice;
  Judge judge(site, calibration, prior, std::move(folds));

  ModelParts parts{
      .offsets = false, .walls = false, .residual_map = false, .bodies = true, .histogram = false};
  Judgement best = judge.Of(parts, {kAll});
  const auto keep_if_better = [&](const ModelParts& candidate, const std::vector<int>& strongest) {
    const Judgement judgement = judge.Of(candidate, strongest);
    if (judgement.log_score < best.log_score + kLeastGain) return;
    best = judgement;
    parts = candidate;
  };
  // What explains most comes first, so that the rest is not added for what it would explain better.
  std::vector<bool ModelParts::*> order = {&ModelParts::residual_map, &ModelParts::offsets};
  if (WallCounter(site.plan).has_walls()) order.push_back(&ModelParts::walls);
  order.push_back(&ModelParts::histogram);
  for (bool ModelParts::*const part : order) {
    ModelParts candidate = parts;
    candidate.*part = true;
    keep_if_better(candidate, {kAll});
  }
  keep_if_better(parts, {4, 6, 8, 12});
  // Presumed, as calibration is often done by one person who keeps out of the way.
  ModelParts alone = parts;
  alone.bodies = false;
  keep_if_better(alone, {best.trust.strongest});

  choice.parts = parts;
  choice.trust = best.trust;
  choice.kernel = judge.kernel();
  choice.held_back_epochs = best.epochs;
  choice.held_back_error_m = best.error_m;
  choice.held_back_log_score = best.log_score;
  return choice;
}

}  // namespace beckon
