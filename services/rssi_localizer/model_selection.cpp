#include "services/rssi_localizer/model_selection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "common/text.hpp"

namespace beckon {
namespace {

constexpr int kFolds = 5;
constexpr double kSquareM = 1.0;
constexpr std::size_t kMaxJudgedEpochs = 250;
constexpr int kMaxCells = 1500;               // judging needs no fine grid
constexpr double kLeastGain = 0.01;           // of the log score per epoch
constexpr double kLeastStandardErrors = 0.5;  // what a part gains is worth a little chance
constexpr int kAll = Trust{}.strongest;
// Weights of the log-likelihoods, each this much above the last.
constexpr double kTemperStep = 1.26;
constexpr std::array<double, 14> kTempers = {0.1,   0.126, 0.159, 0.2,   0.252, 0.318, 0.4,
                                             0.504, 0.635, 0.8,   1.008, 1.27,  1.6,   2.016};

using Square = std::pair<long, long>;

Square SquareOf(const Eigen::Vector2d& position) {
  return {std::lround(std::floor(position.x() / kSquareM)),
          std::lround(std::floor(position.y() / kSquareM))};
}

// What models are judged by: places that were surveyed, or where there are too few, all.
struct Folds {
  bool surveyed_only = false;
  std::map<Square, int> of_square;  // empty where there are too few squares

  bool Judges(Origin origin) const { return !surveyed_only || origin == Origin::kSurvey; }
};

std::map<Square, int> Divide(const CalibrationSet& calibration, const Folds& folds) {
  std::map<Square, int> fold_of;
  for (const CalibrationEpoch& epoch : calibration.epochs) {
    if (folds.Judges(epoch.origin)) fold_of[SquareOf(epoch.position)] = 0;
  }
  if (fold_of.size() < 3) return {};
  int number = 0;
  for (auto& [at, fold] : fold_of) {
    // A lattice in which a square's neighbours belong to other folds, or one after the other where
    // each fold holds only a place or two.
    const long lattice = ((at.first + 2 * at.second) % kFolds + kFolds) % kFolds;
    fold = fold_of.size() <= 2 * kFolds ? number % kFolds : static_cast<int>(lattice);
    ++number;
  }
  return fold_of;
}

Folds MakeFolds(const CalibrationSet& calibration) {
  Folds folds{.surveyed_only = true, .of_square = {}};
  folds.of_square = Divide(calibration, folds);
  if (!folds.of_square.empty()) return folds;
  folds.surveyed_only = false;
  folds.of_square = Divide(calibration, folds);
  return folds;
}

bool Holds(const CalibrationSet& calibration, Origin origin) {
  return std::any_of(calibration.epochs.begin(), calibration.epochs.end(),
                     [&](const CalibrationEpoch& epoch) { return epoch.origin == origin; });
}

struct Judgement {
  Trust trust;
  double error_m = 0.0;           // mean over the judged epochs
  std::vector<double> log_score;  // per square: mean over its judged epochs

  double LogScore() const {
    return std::accumulate(log_score.begin(), log_score.end(), 0.0) /
           static_cast<double>(log_score.size());
  }
};

struct Gain {
  double mean = 0.0;
  double standard_error = 0.0;
};

// Of the log score of `candidate` over that of `reference`. Epochs in one square have their errors
// in common, so that squares and not epochs count.
Gain GainOver(const Judgement& reference, const Judgement& candidate) {
  const auto n = static_cast<double>(reference.log_score.size());
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < reference.log_score.size(); ++i) {
    const double gain = candidate.log_score[i] - reference.log_score[i];
    sum += gain;
    squares += gain * gain;
  }
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1.0))};
}

class Judge {
 public:
  Judge(const Site& site, const CalibrationSet& calibration, const PathLoss& prior, Folds folds)
      : site_(site),
        calibration_(calibration),
        prior_(prior),
        folds_(std::move(folds)),
        grid_(site.plan, {.resolution_m = 0.25, .max_cells = kMaxCells}, Walked(calibration)) {
    std::vector<std::size_t> epochs;
    for (std::size_t i = 0; i < calibration.epochs.size(); ++i) {
      if (folds_.Judges(calibration.epochs[i].origin)) epochs.push_back(i);
    }
    const std::size_t stride = std::max<std::size_t>(1, epochs.size() / kMaxJudgedEpochs);
    std::map<Square, int> number;
    for (std::size_t at = 0; at < epochs.size(); at += stride) {
      const std::size_t i = epochs[at];
      const Square square = SquareOf(calibration.epochs[i].position);
      const int known = number.try_emplace(square, static_cast<int>(number.size())).first->second;
      judged_.push_back({i, folds_.of_square.at(square), known});
    }
    squares_ = number.size();
  }

  // The best of kTempers x `strongest` for a model of these parts.
  Judgement Of(const ModelParts& parts, const std::vector<int>& strongest) {
    // Its three numbers may well come from all readings: what is held back is what they say of a
    // place.
    if (parts.residual_map && !Kernel(parts)) {
      kernels_[KeyOf(parts)] = BuildFittedModel(grid_, site_, calibration_, parts, prior_).kernel;
    }
    std::vector<Judgement> judgements;
    for (const int most : strongest) {
      for (const double temper : kTempers) {
        judgements.push_back({{temper, most}, 0.0, std::vector<double>(squares_, 0.0)});
      }
    }
    for (int fold = 0; fold < kFolds; ++fold) {
      const FittedModel fitted =
          BuildFittedModel(grid_, site_, WithoutFold(fold), parts, prior_, Kernel(parts));
      for (const Judged& judged : judged_) {
        if (judged.fold == fold) AddEpoch(fitted.model, judged, judgements);
      }
    }
    std::vector<double> epochs(squares_, 0.0);
    for (const Judged& judged : judged_) ++epochs[static_cast<std::size_t>(judged.square)];
    for (Judgement& judgement : judgements) {
      for (std::size_t i = 0; i < squares_; ++i) judgement.log_score[i] /= epochs[i];
      judgement.error_m /= static_cast<double>(judged_.size());
    }
    return Best(judgements);
  }

  // Of the residual map in a model of these parts, which was judged before.
  std::optional<ResidualKernel> Kernel(const ModelParts& parts) const {
    const auto known = kernels_.find(KeyOf(parts));
    if (!parts.residual_map || known == kernels_.end()) return std::nullopt;
    return known->second;
  }
  int epochs() const { return static_cast<int>(judged_.size()); }

 private:
  // What the map is made of: the readings that are used, and what offsets and walls leave of them.
  using KernelKey = std::array<bool, 4>;
  static KernelKey KeyOf(const ModelParts& parts) {
    return {parts.between_beacons, parts.by_robot, parts.offsets, parts.walls};
  }

  struct Judged {
    std::size_t epoch;
    int fold;
    int square;  // running number
  };

  static std::vector<Eigen::Vector2d> Walked(const CalibrationSet& calibration) {
    std::vector<Eigen::Vector2d> walked;
    for (const CalibrationEpoch& epoch : calibration.epochs) walked.push_back(epoch.position);
    return walked;
  }

  // With few squares the log score would take chance for knowledge. So the temper has a prior that
  // counts as much as kPriorSquares squares, each with the score that a Gaussian posterior in the
  // plane has on average where the right temper would be kExpectedTemper: log t - t / t_expected.
  double PenalisedScore(const Judgement& judgement) const {
    constexpr double kPriorSquares = 2.0;
    constexpr double kExpectedTemper = 0.4;
    const double temper = judgement.trust.temper;
    return judgement.LogScore() + kPriorSquares / static_cast<double>(squares_) *
                                      (std::log(temper) - temper / kExpectedTemper);
  }

  // The best, its temper refined by the parabola through it and its neighbours.
  Judgement Best(const std::vector<Judgement>& judgements) const {
    std::size_t best = 0;
    for (std::size_t i = 1; i < judgements.size(); ++i) {
      if (PenalisedScore(judgements[i]) > PenalisedScore(judgements[best])) best = i;
    }
    Judgement result = judgements[best];
    const std::size_t at = best % kTempers.size();
    if (at == 0 || at + 1 == kTempers.size()) return result;
    const double below = PenalisedScore(judgements[best - 1]);
    const double here = PenalisedScore(judgements[best]);
    const double above = PenalisedScore(judgements[best + 1]);
    const double curvature = below - 2.0 * here + above;
    if (curvature < 0.0) {
      result.trust.temper *= std::pow(kTemperStep, 0.5 * (below - above) / curvature);
    }
    return result;
  }

  CalibrationSet WithoutFold(int fold) const {
    const auto is_held_back = [&](const Square& square) {
      const auto known = folds_.of_square.find(square);
      return known != folds_.of_square.end() && known->second == fold;
    };
    std::set<Square> beacon_squares;
    for (const Beacon& beacon : site_.beacons) {
      beacon_squares.insert(SquareOf(beacon.position.head<2>()));
    }
    return calibration_.Keeping([&](const CalibrationSample& sample) {
      const auto epoch = static_cast<std::size_t>(sample.epoch);
      const Square tag = SquareOf(calibration_.epochs[epoch].position);
      if (is_held_back(tag)) return false;
      // From one beacon's place to another: the same link, heard from its other end.
      const auto beacon = static_cast<std::size_t>(sample.beacon);
      return !(beacon_squares.contains(tag) &&
               is_held_back(SquareOf(site_.beacons[beacon].position.head<2>())));
    });
  }

  double LogScoreAt(const CellValues& probability, const Eigen::Vector2d& position) const {
    // One moment in twenty may be hopeless (a crowd passes); it must not decide for all others.
    constexpr double kHopeless = 0.05;
    const auto truth = static_cast<std::size_t>(grid_.NearestCell(position));
    const double density = static_cast<double>(probability[truth]) / grid_.cell_area_m2();
    const double even = 1.0 / (grid_.size() * grid_.cell_area_m2());
    return std::log((1.0 - kHopeless) * density + kHopeless * even);
  }

  void AddEpoch(const MeasurementModel& model, const Judged& judged,
                std::vector<Judgement>& judgements) const {
    const CalibrationEpoch& epoch = calibration_.epochs[judged.epoch];
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
      judgement.log_score[static_cast<std::size_t>(judged.square)] +=
          LogScoreAt(probability, epoch.position);
      judgement.error_m += (mean - epoch.position).norm();
    }
  }

  const Site& site_;
  const CalibrationSet& calibration_;
  const PathLoss& prior_;
  Folds folds_;
  FloorGrid grid_;
  std::vector<Judged> judged_;
  std::size_t squares_ = 0;
  std::map<KernelKey, std::optional<ResidualKernel>> kernels_;
};

}  // namespace

std::string ModelChoice::Describe() const {
  std::string description = parts.Describe() + Format(", temper %.2f", trust.temper);
  if (averaging == Averaging::kDecibels) description += ", averaged in dB";
  if (trust.strongest < kAll) {
    description += ", the " + std::to_string(trust.strongest) + " strongest readings";
  }
  if (held_back_epochs > 0) {
    description += Format(" (%d held-back epochs: mean error %.2f m, log score %.3f)",
                          held_back_epochs, held_back_error_m, held_back_log_score);
  }
  return description;
}

ModelChoice ChooseModel(const Site& site, const std::vector<CalibrationReading>& readings,
                        const PathLoss& prior) {
  ModelChoice choice;
  const CalibrationSet calibration = CalibrationSet::Build(site, readings, choice.averaging);
  const Folds folds = MakeFolds(calibration);
  if (folds.of_square.empty()) return choice;
  Judge judge(site, calibration, prior, folds);

  ModelParts parts{.offsets = false,
                   .walls = false,
                   .residual_map = false,
                   .bodies = true,
                   .histogram = false,
                   .between_beacons = false,
                   .by_robot = false};
  Judgement best = judge.Of(parts, {kAll});
  const auto keep_if_better = [&](const std::string& what, const Judgement& judgement) {
    const Gain gain = GainOver(best, judgement);
    const bool kept = gain.mean >= std::max(kLeastGain, kLeastStandardErrors * gain.standard_error);
    choice.trials.push_back({what, gain.mean, gain.standard_error, kept});
    if (kept) best = judgement;
    return kept;
  };
  const auto keep_part_if_better = [&](const std::string& what, bool ModelParts::*part, bool value,
                                       Judge& by) {
    ModelParts candidate = parts;
    candidate.*part = value;
    if (keep_if_better(what, by.Of(candidate, {best.trust.strongest}))) parts = candidate;
  };
  // What the place tells of itself has to agree with what is held back: with what was surveyed, or
  // where little was, with itself.
  const auto use_own_if_better = [&](Judge& by) {
    if (Holds(calibration, Origin::kBeacons)) {
      keep_part_if_better("readings between beacons", &ModelParts::between_beacons, true, by);
    }
    if (Holds(calibration, Origin::kRobot)) {
      keep_part_if_better("the robot's own readings", &ModelParts::by_robot, true, by);
    }
  };
  if (!folds.surveyed_only) use_own_if_better(judge);
  // The simplest comes first, so that nothing is added for what less would explain.
  std::vector<std::pair<std::string, bool ModelParts::*>> order = {
      {"offsets", &ModelParts::offsets}, {"residual map", &ModelParts::residual_map}};
  if (WallCounter(site.plan).has_walls()) order.emplace_back("walls", &ModelParts::walls);
  order.emplace_back("histogram", &ModelParts::histogram);
  for (const auto& [what, part] : order) keep_part_if_better(what, part, true, judge);
  keep_if_better("only the strongest readings", judge.Of(parts, {4, 6, 8, 12}));
  // Presumed, as calibration is often done by one person who keeps out of the way.
  keep_part_if_better("no bodies in the way", &ModelParts::bodies, false, judge);
  // Neither way of averaging is the richer description: the better one is taken.
  const CalibrationSet in_decibels = CalibrationSet::Build(site, readings, Averaging::kDecibels);
  Judge judge_in_decibels(site, in_decibels, prior, folds);
  const Judgement of_decibels = judge_in_decibels.Of(parts, {best.trust.strongest});
  const Gain gain = GainOver(best, of_decibels);
  const bool decibels = gain.mean > 0.0;
  choice.trials.push_back({"averaging dB, not power", gain.mean, gain.standard_error, decibels});
  if (decibels) {
    best = of_decibels;
    choice.averaging = Averaging::kDecibels;
  }

  Judge& chosen = decibels ? judge_in_decibels : judge;
  if (folds.surveyed_only) use_own_if_better(chosen);

  choice.parts = parts;
  choice.trust = best.trust;
  choice.kernel = chosen.Kernel(parts);
  choice.held_back_epochs = judge.epochs();
  choice.held_back_error_m = best.error_m;
  choice.held_back_log_score = best.LogScore();
  return choice;
}

}  // namespace beckon
