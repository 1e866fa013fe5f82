#include "tools/simulation/solids.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace beckon::simulation {
namespace {

double Cross2(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double DistanceToSegment(const Eigen::Vector2d& point, const Eigen::Vector2d& from,
                         const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double t = std::clamp((point - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (point - from - t * along).norm();
}

}  // namespace

Solid MakeCylinder(const std::string& name, SolidKind kind, const Eigen::Vector2d& centre,
                   double radius_m, double height_m) {
  Solid solid;
  solid.name = name;
  solid.kind = kind;
  solid.centre = centre;
  solid.radius = radius_m;
  solid.height_m = height_m;
  return solid;
}

Solid MakeBox(const std::string& name, SolidKind kind, const Pose2& map_from_box,
              const Eigen::Vector2d& size_m, double height_m) {
  Solid solid = MakeCylinder(name, kind, map_from_box.translation(), 0.5 * size_m.norm(), height_m);
  const Eigen::Vector2d half = 0.5 * size_m;
  for (const auto& corner :
       {Eigen::Vector2d(-half.x(), -half.y()), Eigen::Vector2d(half.x(), -half.y()),
        Eigen::Vector2d(half.x(), half.y()), Eigen::Vector2d(-half.x(), half.y())}) {
    solid.footprint.push_back(map_from_box * corner);
  }
  return solid;
}

Solid Transformed(const Pose2& new_from_old, const Solid& solid) {
  Solid moved = solid;
  moved.centre = new_from_old * solid.centre;
  for (Eigen::Vector2d& corner : moved.footprint) corner = new_from_old * corner;
  return moved;
}

std::optional<Crossing> Cross(const Solid& solid, const Eigen::Vector2d& origin,
                              const Eigen::Vector2d& direction) {
  if (solid.is_cylinder()) {
    const Eigen::Vector2d to_centre = solid.centre - origin;
    const double closest = to_centre.dot(direction);
    const double squared =
        solid.radius * solid.radius - to_centre.squaredNorm() + closest * closest;
    if (squared <= 0.0) return std::nullopt;
    const double half_chord = std::sqrt(squared);
    if (closest <= half_chord) return std::nullopt;
    return Crossing{closest - half_chord, closest + half_chord, 0};
  }
  // Cyrus-Beck: the ray is inside a convex polygon where it is inside all edges.
  Crossing crossing{0.0, std::numeric_limits<double>::infinity(), -1};
  const std::size_t count = solid.footprint.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& from = solid.footprint[i];
    const Eigen::Vector2d edge = solid.footprint[(i + 1) % count] - from;
    const double inside = Cross2(edge, origin - from);  // >= 0 left of the edge, that is inside
    const double slope = Cross2(edge, direction);
    if (slope > 0.0) {
      const double t = -inside / slope;
      if (t > crossing.enter_m) {
        crossing.enter_m = t;
        crossing.face = static_cast<int>(i);
      }
    } else if (slope < 0.0) {
      crossing.leave_m = std::min(crossing.leave_m, -inside / slope);
    } else if (inside < 0.0) {
      return std::nullopt;
    }
  }
  if (crossing.face < 0 || crossing.leave_m <= crossing.enter_m) return std::nullopt;
  return crossing;
}

double Distance(const Solid& solid, const Eigen::Vector2d& point) {
  if (solid.is_cylinder()) return (point - solid.centre).norm() - solid.radius;
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = true;
  const std::size_t count = solid.footprint.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& from = solid.footprint[i];
    const Eigen::Vector2d& to = solid.footprint[(i + 1) % count];
    nearest = std::min(nearest, DistanceToSegment(point, from, to));
    inside = inside && Cross2(to - from, point - from) >= 0.0;
  }
  return inside ? -nearest : nearest;
}

double CastRay(const std::vector<Solid>& solids, const Eigen::Vector2d& origin,
               double bearing_rad) {
  const Eigen::Vector2d direction(std::cos(bearing_rad), std::sin(bearing_rad));
  double nearest = std::numeric_limits<double>::infinity();
  for (const Solid& solid : solids) {
    if (const auto crossing = Cross(solid, origin, direction)) {
      nearest = std::min(nearest, crossing->enter_m);
    }
  }
  return nearest;
}

}  // namespace beckon::simulation
