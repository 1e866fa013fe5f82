#include "tools/calibration/mount.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/text.hpp"
#include "tools/calibration/mount_fit.hpp"

namespace beckon {
namespace {

void CheckSpread(const std::vector<FloorPoint>& points) {
  if (points.size() < 4) {
    throw CalibrationError(
        Format("%zu marks are too few: four at the least, and more make it better", points.size()));
  }
  const auto count = static_cast<Eigen::Index>(points.size());
  for (const bool in_picture : {false, true}) {
    Eigen::Matrix2Xd matrix(2, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const FloorPoint& point = points[static_cast<std::size_t>(i)];
      matrix.col(i) = in_picture ? point.ideal : point.floor_m;
    }
    matrix.colwise() -= matrix.rowwise().mean().eval();
    const Eigen::Vector2d spread = matrix.jacobiSvd().singularValues() / std::sqrt(count);
    if (!(spread(1) > 0.02 * spread(0))) {
      throw CalibrationError(Format(
          "all marks lie on one line %s: spread them over the floor, to both sides and far away",
          in_picture ? "in the picture" : "on the floor"));
    }
  }
}

// Errors of single corners and marks, in pixels, with the place of each corner as fitted.
void MeasureErrors(const MountInput& input, const MountResiduals& residuals, Mount& mount) {
  const MountView view = residuals.ViewOf(mount.parameters);
  double squares = 0.0;
  double count = 0.0;
  const auto add = [&](double error_px, const std::string& name) {
    squares += error_px * error_px;
    count += 1.0;
    if (error_px > mount.worst_px) {
      mount.worst_px = error_px;
      mount.worst_name = name;
    }
  };
  for (std::size_t i = 0; i < input.marks.size(); ++i) {
    add((view.Project(input.marks[i].floor_m) - residuals.mark_pixels()[i]).norm(),
        input.marks[i].name);
  }
  for (std::size_t b = 0; b < input.boards.size(); ++b) {
    const FloorBoard& board = input.boards[b];
    for (std::size_t i = 0; i < board.corners.size(); ++i) {
      const auto place = residuals.CornerOnFloor(mount.parameters, b, board.corners[i].board_m);
      add((view.Project(place) - residuals.board_pixels(b)[i]).norm(), board.name);
    }
  }
  mount.rms_px = std::sqrt(squares / count);
}

// One that contradicts the others by more than anybody measures wrong.
void CheckAgreement(const MountInput& input, const MountResiduals& residuals, const Mount& mount) {
  const MountView view = residuals.ViewOf(mount.parameters);
  const FloorMark* odd = nullptr;
  double odd_off_px = 0.0;
  double oddest = 4.0;  // standard deviations
  for (std::size_t i = 0; i < input.marks.size(); ++i) {
    const FloorMark& mark = input.marks[i];
    const Eigen::Vector2d place =
        mount.parameters.segment<2>(residuals.marks_at() + 2 * static_cast<int>(i));
    const double off_px = (view.Project(place) - residuals.mark_pixels()[i]).norm();
    const double deviation =
        std::max((place - mark.floor_m).norm() / kTapeSigmaM, off_px / kMarkSigmaPx);
    if (deviation <= oddest) continue;
    oddest = deviation;
    odd = &mark;
    odd_off_px = (view.Project(mark.floor_m) - residuals.mark_pixels()[i]).norm();
  }
  if (odd != nullptr) {
    throw CalibrationError(Format(
        "%s does not agree with the others: it lies %.0f pixels from where they put it; was it "
        "measured or found wrongly?",
        odd->name.c_str(), odd_off_px));
  }
  for (std::size_t b = 0; b < input.boards.size(); ++b) {
    const FloorBoard& board = input.boards[b];
    const Eigen::Vector2d first = residuals.CornerOnFloor(mount.parameters, b, {0.0, 0.0});
    if ((first - board.first_m).norm() > 4.0 * kTapeSigmaM) {
      throw CalibrationError(Format(
          "%s: the board's first corner is measured at (%.3f, %.3f) m, but the others put it at "
          "(%.3f, %.3f) m; are first and second corner swapped? The rest of the board lies to "
          "the right of the way from the first to the second",
          board.name.c_str(), board.first_m.x(), board.first_m.y(), first.x(), first.y()));
    }
  }
  const Eigen::Vector3d centre = view.Centre();
  if ((centre.head<2>() - input.camera_at).norm() > 3.0 * kCameraAtSigmaM) {
    throw CalibrationError(Format(
        "the camera would be over (%.3f, %.3f) m instead of (%.3f, %.3f) m: measure from the "
        "point below it, or tell with camera_at where that point is",
        centre.x(), centre.y(), input.camera_at.x(), input.camera_at.y()));
  }
  Eigen::VectorXd values(residuals.values());
  residuals(mount.parameters, values);
  const double freedom = std::max(1, residuals.values() - residuals.inputs());
  constexpr double kWorstMisfit = 5.0;  // times what tape and pictures are expected to err
  if (std::sqrt(values.squaredNorm() / freedom) > kWorstMisfit) {
    throw CalibrationError(Format(
        "corners and marks are off by %.1f pixels (rms), %s most, by %.1f: measured wrongly, or "
        "a lens with distortion without pictures of the board to tell it from",
        mount.rms_px, mount.worst_name.c_str(), mount.worst_px));
  }
}

void CheckGeometry(const std::vector<FloorPoint>& points, const Mount& mount) {
  const GroundCamera& camera = mount.camera;
  if (!(camera.height_m > 0.03 && camera.height_m < 20.0)) {
    throw CalibrationError(Format("the camera would be %.3f m above the floor", camera.height_m));
  }
  if (std::abs(mount.pan_rad) > 0.5 * std::numbers::pi) {
    throw CalibrationError(
        "the camera would look backwards: x has to grow away from the robot, where it looks");
  }
  const auto bottom = camera.GroundFromPixel({camera.cx, camera.height - 1.0});
  if (!bottom || bottom->x() <= 0.0) {
    throw CalibrationError("the bottom of the picture would not show floor before the robot");
  }
  for (const FloorPoint& point : points) {
    if (!camera.GroundFromPixel(point.ideal)) {
      throw CalibrationError(Format(
          "the mark at (%.2f, %.2f) m would lie above the horizon, at row %.0f of the picture",
          point.floor_m.x(), point.floor_m.y(), camera.HorizonRow(point.ideal.x())));
    }
  }
  constexpr double kJudgedAtM = 3.0;
  const double sigma_m = mount.RangeSigma(kJudgedAtM);
  if (!(sigma_m < 0.1 * kJudgedAtM)) {
    throw CalibrationError(Format(
        "the marks are too close together: at 3 m the floor would be known to %.2f m only; lay "
        "some farther away and to the sides",
        sigma_m));
  }
}

// Checks what was measured of each board, and finds which way round it lies.
void OrientBoards(MountInput& input) {
  for (FloorBoard& board : input.boards) {
    const double measured_m = (board.second_m - board.first_m).norm();
    const double printed_m = input.board.extent().x();
    if (std::abs(measured_m - printed_m) > std::max(4.0 * kTapeSigmaM, 0.03 * printed_m)) {
      throw CalibrationError(Format(
          "%s: from the first to the second corner it is %.3f m as measured, but %.3f m by the "
          "board's squares",
          board.name.c_str(), measured_m, printed_m));
    }
    // Which way round the board lies: what is farther away appears higher up.
    const double direction =
        std::atan2(board.second_m.y() - board.first_m.y(), board.second_m.x() - board.first_m.x());
    Eigen::Vector2d mean_pixel = Eigen::Vector2d::Zero();
    for (const BoardCorner& corner : board.corners) mean_pixel += corner.pixel;
    mean_pixel /= static_cast<double>(board.corners.size());
    double agreement = 0.0;
    for (const BoardCorner& corner : board.corners) {
      const Eigen::Vector2d floor_m =
          FloorFromBoard(board.first_m, direction, corner.board_m - 0.5 * input.board.extent());
      agreement -= (floor_m.x() - board.first_m.x()) * (corner.pixel.y() - mean_pixel.y());
    }
    if (agreement < 0.0) board.corners = HalfTurned(std::move(board.corners), input.board);
  }
}

// What height the rest gives, before the measured one may have a say.
void CheckHeight(const MountInput& input) {
  if (!input.camera_height_m) return;
  MountInput without = input;
  without.camera_height_m.reset();
  const MountResiduals residuals(without);
  const Mount mount = Fit(without, residuals);
  const double difference = mount.camera.height_m - *input.camera_height_m;
  // The height answers to the pose alone: its gradient, by small steps.
  const auto height_at = [&](const Eigen::VectorXd& p) { return residuals.ViewOf(p).Centre().z(); };
  Eigen::VectorXd gradient(mount.parameters.size());
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    constexpr double kStep = 1e-6;
    Eigen::VectorXd moved = mount.parameters;
    moved(i) += kStep;
    gradient(i) = (height_at(moved) - mount.camera.height_m) / kStep;
  }
  const double sigma_m =
      std::hypot(kHeightSigmaM, std::sqrt(gradient.dot(mount.covariance * gradient)));
  if (!(std::abs(difference) < 4.0 * sigma_m)) {
    throw CalibrationError(
        Format("the camera would be %.3f m above the floor, but %.3f m was measured",
               mount.camera.height_m, *input.camera_height_m));
  }
}

}  // namespace

double Mount::RangeSigma(double range_m) const {
  const auto pixel = camera.PixelFromGround({range_m, 0.0});
  if (!pixel) return std::numeric_limits<double>::infinity();
  // How the range at that pixel answers to each parameter of the camera.
  MountInput input;
  input.size = {camera.width, camera.height};
  const bool focal_is_fitted = parameters.size() > kPoseParameters && fits_focal_length;
  if (!focal_is_fitted) {
    input.lens = Lens{camera.fx, camera.fy, camera.cx, camera.cy, {}, 0.0};
  }
  const MountResiduals residuals(input);
  const auto range_at = [&](const Eigen::VectorXd& p) {
    const auto point = CameraOf(residuals.ViewOf(p), input).GroundFromPixel(*pixel);
    return point ? point->norm() : std::numeric_limits<double>::infinity();
  };
  const int count = kPoseParameters + (focal_is_fitted ? 1 : 0);
  Eigen::VectorXd gradient(count);
  for (int i = 0; i < count; ++i) {
    constexpr double kStep = 1e-5;
    Eigen::VectorXd up = parameters;
    Eigen::VectorXd down = parameters;
    up(i) += kStep;
    down(i) -= kStep;
    gradient(i) = (range_at(up) - range_at(down)) / (2.0 * kStep);
  }
  return std::sqrt(gradient.dot(covariance.topLeftCorner(count, count) * gradient));
}

Mount SolveMount(const MountInput& given) {
  MountInput input = given;
  OrientBoards(input);
  const MountResiduals residuals(input);
  const std::vector<FloorPoint> points = FloorPoints(input, residuals);
  CheckSpread(points);
  CheckHeight(input);
  Mount mount = Fit(input, residuals);
  MeasureErrors(input, residuals, mount);
  CheckAgreement(input, residuals, mount);
  CheckGeometry(points, mount);
  return mount;
}

}  // namespace beckon
