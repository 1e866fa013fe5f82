#include "tools/calibration/mount_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <optional>
#include <unsupported/Eigen/NonLinearOptimization>

namespace beckon {
namespace {

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
Eigen::VectorXd FirstGuess(const MountInput& input, const MountResiduals& residuals,
                           const std::vector<FloorPoint>& points) {
  std::vector<cv::Point2d> floor, pixels;
  for (const FloorPoint& point : points) {
    floor.emplace_back(point.floor_m.x(), point.floor_m.y());
    pixels.emplace_back(point.ideal.x(), point.ideal.y());
  }
  const cv::Mat found = cv::findHomography(floor, pixels);
  if (found.empty()) throw CalibrationError("no homography fits the marks");
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
  const MountView lens = residuals.ViewOf(p);
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
    throw CalibrationError(
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

Eigen::MatrixXd CovarianceAt(const MountResiduals& residuals, const Eigen::VectorXd& p) {
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

}  // namespace

Eigen::Vector2d FloorFromBoard(const Eigen::Vector2d& origin_m, double direction_rad,
                               const Eigen::Vector2d& board_m) {
  const Eigen::Vector2d along(std::cos(direction_rad), std::sin(direction_rad));
  return origin_m + board_m.x() * along + board_m.y() * Eigen::Vector2d(along.y(), -along.x());
}

MountResiduals::MountResiduals(const MountInput& input) : input_(&input) {
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

MountView MountResiduals::ViewOf(const Eigen::VectorXd& p) const {
  MountView view;
  const Eigen::Vector3d turn = p.head<3>();
  const double angle = turn.norm();
  view.camera_from_floor = angle > 1e-12 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix()
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

Eigen::Vector2d MountResiduals::CornerOnFloor(const Eigen::VectorXd& p, std::size_t board,
                                              const Eigen::Vector2d& board_m) const {
  const Eigen::Vector3d pose =
      p.segment<3>(boards_at() + kBoardParameters * static_cast<int>(board));
  return FloorFromBoard(pose.head<2>(), pose.z(), board_m);
}

int MountResiduals::operator()(const Eigen::VectorXd& p, Eigen::VectorXd& residuals) const {
  const MountView view = ViewOf(p);
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
int MountResiduals::df(const Eigen::VectorXd& p, Eigen::MatrixXd& jacobian) const {
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

std::vector<FloorPoint> FloorPoints(const MountInput& input, const MountResiduals& residuals) {
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

GroundCamera CameraOf(const MountView& view, const MountInput& input) {
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

Mount Fit(const MountInput& input, const MountResiduals& residuals) {
  Mount mount;
  mount.fits_focal_length = !input.lens;
  mount.parameters = FirstGuess(input, residuals, FloorPoints(input, residuals));
  MountResiduals function = residuals;
  Eigen::LevenbergMarquardt<MountResiduals> search(function);
  search.minimize(mount.parameters);
  mount.covariance = CovarianceAt(residuals, mount.parameters);
  const MountView view = residuals.ViewOf(mount.parameters);
  mount.camera = CameraOf(view, input);
  const Eigen::Vector3d axis = view.camera_from_floor.row(2);
  const Eigen::Vector3d right = view.camera_from_floor.row(0);
  mount.pan_rad = std::atan2(axis.y(), axis.x());
  mount.roll_rad = -std::asin(std::clamp(right.z(), -1.0, 1.0));
  return mount;
}

}  // namespace beckon
