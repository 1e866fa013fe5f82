// Upright things: everything in the flat that rises from the floor is a vertical prism or cylinder.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/floor_plan.hpp"
#include "common/frames.hpp"

namespace beckon::simulation {

enum class SolidKind { kWall, kFurniture, kPerson };

struct Solid {
  std::string name;  // for reports: "wall 3", "furniture 2", "person 1"
  SolidKind kind = SolidKind::kFurniture;
  Polygon footprint;  // convex, counter-clockwise; empty for a cylinder
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // m, map frame
  double radius = 0.0;  // m: of the cylinder, or of the circle round the prism
  double height_m = 1.0;

  bool is_cylinder() const { return footprint.empty(); }
};

Solid MakeCylinder(const std::string& name, SolidKind kind, const Eigen::Vector2d& centre,
                   double radius_m, double height_m);
// `size`: length along the pose's x and y axes, m; the pose is that of the middle.
Solid MakeBox(const std::string& name, SolidKind kind, const Pose2& map_from_box,
              const Eigen::Vector2d& size_m, double height_m);

// The same thing seen from another frame.
Solid Transformed(const Pose2& new_from_old, const Solid& solid);

// Where a ray in the plane passes through the footprint.
struct Crossing {
  double enter_m;  // along the ray
  double leave_m;
  int face;  // edge of the footprint through which it enters: from point `face` to the next
};
// `direction` has length 1. Nothing where the ray misses or starts inside.
std::optional<Crossing> Cross(const Solid& solid, const Eigen::Vector2d& origin,
                              const Eigen::Vector2d& direction);

// From the point to the footprint, m; negative inside (then at least as deep as the nearest edge).
double Distance(const Solid& solid, const Eigen::Vector2d& point);

// Distance along `bearing_rad` to the nearest of the solids; infinity where there is none.
double CastRay(const std::vector<Solid>& solids, const Eigen::Vector2d& origin, double bearing_rad);

}  // namespace beckon::simulation
