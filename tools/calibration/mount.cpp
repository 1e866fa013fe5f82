#include "tools/calibration/mount.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <unsupported/Eigen/NonLinearOptimization>

#include "common/frames.hpp"

namespace beckon {
namespace {

// What can be expected of a person with a tape measure, and of corners in a picture.
constexpr double kTapeSigmaM = 0.005;
constexpr double kCameraAtSigmaM = 0.02;
constexpr double kHeightSigmaM = 0.01;
constexpr double kBoardSigmaPx = 0.3;
constexpr double kMarkSigmaPx = 1.0;

constexpr int kPoseParameters = 6;   // turn vector and translation, camera from floor
constexpr int kBoardParameters = 3;  // x, y of its first corner, direction of its rows

__attribute__((format(printf, 1, 2))) [[noreturn]] void Refuse(const char* format, ...) {
  char text[512];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof(text), format, arguments);
  va_end(arguments);
  throw CalibrationError(text);
}

// Seen from above the page, y down the page is to the right of x along it.
Eigen::Vector2d FloorFromBoard(const Eigen::Vector2d& origin_m, double direction_rad,
                               const Eigen::Vector2d& board_m) {
  const Eigen::Vector2d along(std::cos(direction_rad), std::sin(direction_rad));
  return origin_m + board_m.x() * along + board_m.y() * Eigen::Vector2d(along.y(), -along.x());
}

struct View {
  Eigen::Matrix3d camera_from_floor;  // turns floor axes into those of the camera
  Eigen::Vector3d translation;
  double fx, fy, cx, cy;

  Eigen::Vector2d Project(const Eigen::Vector2d& floor_m) const {
    const Eigen::Vector3d point =
        camera_from_floor * Eigen::Vector3d(floor_m.x(), floor_m.y(), 0.0) + translation;
    // A step of the search may put a point behind the camera; it must not be drawn there.
    const double depth = std::max(point.z(), 1e-3);
    return {fx * point.x() / depth + cx, fy * point.y() / depth + cy};
  }
  Eigen::Vector3d Centre() const { return -camera_from_floor.transpose() * translation; }
};

// The fit as a function from parameters to residuals, each in units of its standard deviation.
class Residuals {
 public:
  using Scalar = double;  // for Eigen::LevenbergMarquardt

  explicit Residuals(const MountInput& input) : input_(&input) {
    const auto ideal = [&](const Eigen::Vector2d& pixel) {
      return input.lens ? input.lens->Undistorted(pixel) : pixel;
    };
    for (const FloorMark& mark : input.marks) mark_pixels_.push_back(ideal(mark.pixel));
    for (const FloorBoard& board : input.boards) {
      board_pixels_.emplace_back();
      for (const BoardCorner& corner : board.corners) {
        board_pixels_.back().push_back(ideal(corner.pixel));
      }
      values_ += 2 * static_cast<int>(board.corners.size()) + 4;
    }
    values_ += 4 * static_cast<int>(input.marks.size());
    values_ += 2 + (input.camera_height_m ? 1 : 0);
  }

  int boards_at() const { return kPoseParameters + (input_->lens ? 0 : 1); }
  int marks_at() const {
    return boards_at() + kBoardParameters * static_cast<int>(input_->boards.size());
  }
  int inputs() const { return marks_at() + 2 * static_cast<int>(input_->marks.size()); }
  int values() const { return values_; }
  const std::vector<Eigen::Vector2d>& mark_pixels() const { return mark_pixels_; }
  const std::vector<Eigen::Vector2d>& board_pixels(std::size_t board) const {
    return board_pixels_[board];
  }

  View ViewOf(const Eigen::VectorXd& p) const {
    View view;
    const Eigen::Vector3d turn = p.head<3>();
    const double angle = turn.norm();
    view.camera_from_floor = angle > 1e-12
                                 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix()
                                 : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    view.translation = p.segment<3>(3);
    if (input_->lens) {
      view.fx = input_->lens->fx;
      view.fy = input_->lens->fy;
      view.cx = input_->lens->cx;
      view.cy = input_->lens->cy;
    } else {
      view.fx = view.fy = std::exp(p(kPoseParameters));
      view.cx = 0.5 * (input_->size.width - 1);
      view.cy = 0.5 * (input_->size.height - 1);
    }
    return view;
  }
  Eigen::Vector2d CornerOnFloor(const Eigen::VectorXd& p, std::size_t board,
                                const Eigen::Vector2d& board_m) const {
    const Eigen::Vector3d pose =
        p.segment<3>(boards_at() + kBoardParameters * static_cast<int>(board));
    return FloorFromBoard(pose.head<2>(), pose.z(), board_m);
  }

  int operator()(const Eigen::VectorXd& p, Eigen::VectorXd& residuals) const {
    const View view = ViewOf(p);
    int next = 0;
    const auto put = [&](const Eigen::Vector2d& error, double sigma) {
      residuals.segment<2>(next) = error / sigma;
      next += 2;
    };
    for (std::size_t i = 0; i < input_->marks.size(); ++i) {
      const Eigen::Vector2d floor_m = p.segment<2>(marks_at() + 2 * static_cast<int>(i));
      put(view.Project(floor_m) - mark_pixels_[i], kMarkSigmaPx);
      put(floor_m - input_->marks[i].floor_m, kTapeSigmaM);
    }
    for (std::size_t b = 0; b < input_->boards.size(); ++b) {
      const FloorBoard& board = input_->boards[b];
      for (std::size_t i = 0; i < board.corners.size(); ++i) {
        put(view.Project(CornerOnFloor(p, b, board.corners[i].board_m)) - board_pixels_[b][i],
            kBoardSigmaPx);
      }
      put(CornerOnFloor(p, b, Eigen::Vector2d::Zero()) - board.first_m, kTapeSigmaM);
      put(CornerOnFloor(p, b, {input_->board.extent().x(), 0.0}) - board.second_m, kTapeSigmaM);
    }
    const Eigen::Vector3d centre = view.Centre();
    put(centre.head<2>() - input_->camera_at, kCameraAtSigmaM);
    if (input_->camera_height_m) {
      residuals(next++) = (centre.z() - *input_->camera_height_m) / kHeightSigmaM;
    }
    return 0;
  }

  // Radians, metres and a logarithm are all of the same size here, so one step fits all.
  int df(const Eigen::VectorXd& p, Eigen::MatrixXd& jacobian) const {
    constexpr double kStep = 1e-6;
    Eigen::VectorXd up(values());
    Eigen::VectorXd down(values());
    for (Eigen::Index i = 0; i < p.size(); ++i) {
      Eigen::VectorXd moved = p;
      moved(i) = p(i) + kStep;
      (*this)(moved, up);
      moved(i) = p(i) - kStep;
      (*this)(moved, down);
      jacobian.col(i) = (up - down) / (2.0 * kStep);
    }
    return 0;
  }

 private:
  const MountInput* input_;
  std::vector<Eigen::Vector2d> mark_pixels_;                // ideal
  std::vector<std::vector<Eigen::Vector2d>> board_pixels_;  // ideal
  int values_ = 0;
};

struct FloorPoint {
  Eigen::Vector2d floor_m;
  Eigen::Vector2d ideal;
};

// Of all that was measured, as if the tape did not err.
std::vector<FloorPoint> FloorPoints(const MountInput& input, const Residuals& residuals) {
  std::vector<FloorPoint> points;
  for (std::size_t i = 0; i < input.marks.size(); ++i) {
    points.push_back({input.marks[i].floor_m, residuals.mark_pixels()[i]});
  }
  for (std::size_t b = 0; b < input.boards.size(); ++b) {
    const FloorBoard& board = input.boards[b];
    const Eigen::Vector2d along = board.second_m - board.first_m;
    for (std::size_t i = 0; i < board.corners.size(); ++i) {
      points.push_back({FloorFromBoard(board.first_m, std::atan2(along.y(), along.x()),
                                       board.corners[i].board_m),
                        residuals.board_pixels(b)[i]});
    }
  }
  return points;
}

void CheckSpread(const std::vector<FloorPoint>& points) {
  if (points.size() < 4) {
    Refuse("%zu marks are too few: four at the least, and more make it better", points.size());
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
      Refuse("all marks lie on one line %s: spread them over the floor, to both sides and far away",
             in_picture ? "in the picture" : "on the floor");
    }
  }
}

// Zhang's constraint on the focal length from one homography, the centre known; nothing where it
// does not hold.
std::optional<double> FocalLengthOf(const Eigen::Matrix3d& h, double cx, double cy) {
  Eigen::Matrix3d shift = Eigen::Matrix3d::Identity();
  shift(0, 2) = -cx;
  shift(1, 2) = -cy;
  const Eigen::Matrix3d c = shift * h;
  const double squared = (c.col(0).head<2>().squaredNorm() - c.col(1).head<2>().squaredNorm()) /
                         (c(2, 1) * c(2, 1) - c(2, 0) * c(2, 0));
  if (!(squared > 0.0) || !std::isfinite(squared)) return std::nullopt;
  return std::sqrt(squared);
}

// Where to begin: from the homography that fits the points best.
Eigen::VectorXd FirstGuess(const MountInput& input, const Residuals& residuals,
                           const std::vector<FloorPoint>& points) {
  std::vector<cv::Point2d> floor, pixels;
  for (const FloorPoint& point : points) {
    floor.emplace_back(point.floor_m.x(), point.floor_m.y());
    pixels.emplace_back(point.ideal.x(), point.ideal.y());
  }
  const cv::Mat found = cv::findHomography(floor, pixels);
  if (found.empty()) Refuse("no homography fits the marks");
  Eigen::Matrix3d h;
  for (int i = 0; i < 9; ++i) h(i / 3, i % 3) = found.at<double>(i / 3, i % 3);
  double depth = 0.0;
  for (const FloorPoint& point : points) depth += h.row(2).dot(point.floor_m.homogeneous());
  if (depth < 0.0) h = -h;

  Eigen::VectorXd p = Eigen::VectorXd::Zero(residuals.inputs());
  if (!input.lens) {
    const double middle_u = 0.5 * (input.size.width - 1);
    const double middle_v = 0.5 * (input.size.height - 1);
    const double width = input.size.width;
    const double focal = FocalLengthOf(h, middle_u, middle_v).value_or(width);
    p(kPoseParameters) = std::log(std::clamp(focal, 0.2 * width, 10.0 * width));
  }
  const View lens = residuals.ViewOf(p);
  Eigen::Matrix3d matrix;
  matrix << lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d columns = matrix.inverse() * h;
  const double scale = 2.0 / (columns.col(0).norm() + columns.col(1).norm());
  Eigen::Matrix3d axes;
  axes.leftCols<2>() = scale * columns.leftCols<2>();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Vector3d translation = scale * columns.col(2);
  if ((-turn.transpose() * translation).z() <= 0.0) {
    Refuse(
        "the camera would be below the floor: the marks are mirrored; x has to grow away from "
        "the robot and y to its left");
  }
  const Eigen::AngleAxisd angle(turn);
  p.head<3>() = angle.angle() * angle.axis();
  p.segment<3>(3) = translation;
  for (std::size_t b = 0; b < input.boards.size(); ++b) {
    const FloorBoard& board = input.boards[b];
    const Eigen::Vector2d along = board.second_m - board.first_m;
    p.segment<3>(residuals.boards_at() + kBoardParameters * static_cast<int>(b)) << board.first_m,
        std::atan2(along.y(), along.x());
  }
  for (std::size_t i = 0; i < input.marks.size(); ++i) {
    p.segment<2>(residuals.marks_at() + 2 * static_cast<int>(i)) = input.marks[i].floor_m;
  }
  return p;
}

Eigen::MatrixXd CovarianceAt(const Residuals& residuals, const Eigen::VectorXd& p) {
  Eigen::MatrixXd jacobian(residuals.values(), residuals.inputs());
  residuals.df(p, jacobian);
  Eigen::VectorXd values(residuals.values());
  residuals(p, values);
  const double freedom = std::max(1, residuals.values() - residuals.inputs());
  // Errors larger than expected make the result as much less certain.
  const double scale = std::max(1.0, values.squaredNorm() / freedom);
  return scale *
         (jacobian.transpose() * jacobian).completeOrthogonalDecomposition().pseudoInverse();
}

// The camera over the origin of its own frame, which has the axes of the measured one.
GroundCamera CameraOf(const View& view, const MountInput& input) {
  GroundCamera camera;
  camera.width = input.size.width;
  camera.height = input.size.height;
  camera.fx = view.fx;
  camera.fy = view.fy;
  camera.cx = view.cx;
  camera.cy = view.cy;
  if (input.lens) camera.distortion = input.lens->distortion;
  const Eigen::Vector3d centre = view.Centre();
  camera.height_m = centre.z();
  camera.tilt_down_rad = -std::asin(std::clamp(view.camera_from_floor(2, 2), -1.0, 1.0));
  Eigen::Matrix3d image_from_floor;
  image_from_floor.leftCols<2>() = view.camera_from_floor.leftCols<2>();
  image_from_floor.col(2) = -view.camera_from_floor.col(2) * centre.z();
  Eigen::Matrix3d matrix;
  matrix << view.fx, 0.0, view.cx, 0.0, view.fy, view.cy, 0.0, 0.0, 1.0;
  camera.ground_from_image = (matrix * image_from_floor).inverse();
  camera.ground_from_image /= camera.ground_from_image.cwiseAbs().maxCoeff();
  return camera;
}

// The fit without any judgement of it.
Mount Fit(const MountInput& input, const Residuals& residuals) {
  Mount mount;
  mount.fits_focal_length = !input.lens;
  mount.parameters = FirstGuess(input, residuals, FloorPoints(input, residuals));
  Residuals function = residuals;
  Eigen::LevenbergMarquardt<Residuals> search(function);
  search.minimize(mount.parameters);
  mount.covariance = CovarianceAt(residuals, mount.parameters);
  const View view = residuals.ViewOf(mount.parameters);
  mount.camera = CameraOf(view, input);
  const Eigen::Vector3d axis = view.camera_from_floor.row(2);
  const Eigen::Vector3d right = view.camera_from_floor.row(0);
  mount.pan_rad = std::atan2(axis.y(), axis.x());
  mount.roll_rad = -std::asin(std::clamp(right.z(), -1.0, 1.0));
  return mount;
}

// Errors of single corners and marks, in pixels, with the place of each corner as fitted.
void MeasureErrors(const MountInput& input, const Residuals& residuals, Mount& mount) {
  const View view = residuals.ViewOf(mount.parameters);
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
void CheckAgreement(const MountInput& input, const Residuals& residuals, const Mount& mount) {
  const View view = residuals.ViewOf(mount.parameters);
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
    Refuse(
        "%s does not agree with the others: it lies %.0f pixels from where they put it; was it "
        "measured or found wrongly?",
        odd->name.c_str(), odd_off_px);
  }
  for (std::size_t b = 0; b < input.boards.size(); ++b) {
    const FloorBoard& board = input.boards[b];
    const Eigen::Vector2d first = residuals.CornerOnFloor(mount.parameters, b, {0.0, 0.0});
    if ((first - board.first_m).norm() > 4.0 * kTapeSigmaM) {
      Refuse(
          "%s: the board's first corner is measured at (%.3f, %.3f) m, but the others put it at "
          "(%.3f, %.3f) m; are first and second corner swapped? The rest of the board lies to "
          "the right of the way from the first to the second",
          board.name.c_str(), board.first_m.x(), board.first_m.y(), first.x(), first.y());
    }
  }
  const Eigen::Vector3d centre = view.Centre();
  if ((centre.head<2>() - input.camera_at).norm() > 3.0 * kCameraAtSigmaM) {
    Refuse(
        "the camera would be over (%.3f, %.3f) m instead of (%.3f, %.3f) m: measure from the "
        "point below it, or tell with camera_at where that point is",
        centre.x(), centre.y(), input.camera_at.x(), input.camera_at.y());
  }
  Eigen::VectorXd values(residuals.values());
  residuals(mount.parameters, values);
  const double freedom = std::max(1, residuals.values() - residuals.inputs());
  constexpr double kWorstMisfit = 5.0;  // times what tape and pictures are expected to err
  if (std::sqrt(values.squaredNorm() / freedom) > kWorstMisfit) {
    Refuse(
        "corners and marks are off by %.1f pixels (rms), %s most, by %.1f: measured wrongly, or "
        "a lens with distortion without pictures of the board to tell it from",
        mount.rms_px, mount.worst_name.c_str(), mount.worst_px);
  }
}

void CheckGeometry(const std::vector<FloorPoint>& points, const Mount& mount) {
  const GroundCamera& camera = mount.camera;
  if (!(camera.height_m > 0.03 && camera.height_m < 20.0)) {
    Refuse("the camera would be %.3f m above the floor", camera.height_m);
  }
  if (std::abs(mount.pan_rad) > 0.5 * std::numbers::pi) {
    Refuse("the camera would look backwards: x has to grow away from the robot, where it looks");
  }
  const auto bottom = camera.GroundFromPixel({camera.cx, camera.height - 1.0});
  if (!bottom || bottom->x() <= 0.0) {
    Refuse("the bottom of the picture would not show floor before the robot");
  }
  for (const FloorPoint& point : points) {
    if (!camera.GroundFromPixel(point.ideal)) {
      Refuse("the mark at (%.2f, %.2f) m would lie above the horizon, at row %.0f of the picture",
             point.floor_m.x(), point.floor_m.y(), camera.HorizonRow(point.ideal.x()));
    }
  }
  constexpr double kJudgedAtM = 3.0;
  const double sigma_m = mount.RangeSigma(kJudgedAtM);
  if (!(sigma_m < 0.1 * kJudgedAtM)) {
    Refuse(
        "the marks are too close together: at 3 m the floor would be known to %.2f m only; lay "
        "some farther away and to the sides",
        sigma_m);
  }
}

// Checks what was measured of each board, and finds which way round it lies.
void OrientBoards(MountInput& input) {
  for (FloorBoard& board : input.boards) {
    const double measured_m = (board.second_m - board.first_m).norm();
    const double printed_m = input.board.extent().x();
    if (std::abs(measured_m - printed_m) > std::max(4.0 * kTapeSigmaM, 0.03 * printed_m)) {
      Refuse(
          "%s: from the first to the second corner it is %.3f m as measured, but %.3f m by the "
          "board's squares",
          board.name.c_str(), measured_m, printed_m);
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
  const Residuals residuals(without);
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
    Refuse("the camera would be %.3f m above the floor, but %.3f m was measured",
           mount.camera.height_m, *input.camera_height_m);
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
  const Residuals residuals(input);
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
  const Residuals residuals(input);
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
