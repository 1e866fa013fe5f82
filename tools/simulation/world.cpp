#include "tools/simulation/world.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>

#include "tools/simulation/floor_layout.hpp"
#include "tools/simulation/random.hpp"

namespace beckon::simulation {
namespace {

constexpr double kCellM = 0.05;
constexpr double kDoorClearM = 0.75;  // no furniture nearer than this to the middle of a door

// Whether everything that is free for a disc of this radius hangs together. Pockets smaller than a
// robot do not count.
bool IsOnePiece(const ClearanceMap& map, double radius_m) {
  const cv::Mat free = map.distance_m >= radius_m;
  cv::Mat labels, statistics, centroids;
  const int count = cv::connectedComponentsWithStats(free, labels, statistics, centroids, 4);
  int large = 0;
  for (int i = 1; i < count; ++i) {
    large += statistics.at<int>(i, cv::CC_STAT_AREA) * kCellM * kCellM > 0.05;
  }
  return large == 1;
}

std::size_t RoomOf(const World& world, const Eigen::Vector2d& point) {
  for (std::size_t i = 0; i < world.rooms.size(); ++i) {
    if (world.rooms[i].Contains(point)) return i;
  }
  return world.rooms.size();
}

Solid RandomFurniture(const Room& room, int number, Random& random) {
  const std::string name = "furniture " + std::to_string(number);
  const Eigen::Vector2d size = room.max - room.min;
  if (random.Chance(0.35)) {
    const double radius = random.Uniform(0.12, 0.3);
    const Eigen::Vector2d span = size.array() - 2.0 * radius;
    const Eigen::Vector2d centre =
        room.min.array() + radius + span.array() * random.UniformIn({0.0, 0.0}, {1.0, 1.0}).array();
    return MakeCylinder(name, SolidKind::kFurniture, centre, radius, random.Uniform(0.35, 1.3));
  }
  const double length = random.Uniform(0.35, 1.4);
  const double depth = random.Uniform(0.3, 0.6);
  const double height = random.Uniform(0.3, 1.8);
  if (random.Chance(0.6)) {  // with its back against a wall
    const int side = random.Integer(0, 3);
    const int across = side % 2;  // axis at right angles to the wall
    Eigen::Vector2d centre;
    centre[1 - across] =
        random.Uniform(room.min[1 - across] + 0.5 * length, room.max[1 - across] - 0.5 * length);
    centre[across] = side < 2 ? room.min[across] + 0.5 * depth : room.max[across] - 0.5 * depth;
    const double heading = across == 1 ? 0.0 : 0.5 * std::numbers::pi;
    return MakeBox(name, SolidKind::kFurniture, {centre.x(), centre.y(), heading}, {length, depth},
                   height);
  }
  const double reach = 0.5 * std::hypot(length, depth);
  const Eigen::Vector2d span = (size.array() - 2.0 * reach).max(0.0);
  const Eigen::Vector2d centre =
      room.min.array() + reach + span.array() * random.UniformIn({0.0, 0.0}, {1.0, 1.0}).array();
  return MakeBox(name, SolidKind::kFurniture,
                 {centre.x(), centre.y(), random.Uniform(0.0, std::numbers::pi)}, {length, depth},
                 height);
}

bool HasSpaceFor(const Solid& thing, const World& world) {
  for (const Door& door : world.doors) {
    if (Distance(thing, door.centre) < kDoorClearM) return false;
  }
  for (const Solid& other : world.solids) {
    if (other.kind == SolidKind::kWall) continue;
    if ((other.centre - thing.centre).norm() < other.radius + thing.radius + 0.05) return false;
  }
  return true;
}

void Furnish(const WorldOptions& options, Random& random, World& world) {
  const int pieces = random.Integer(options.min_furniture, options.max_furniture);
  const double passage_m = options.robot_radius_m + options.margin_m;
  int placed = 0;
  for (int attempt = 0; attempt < 20 * pieces && placed < pieces; ++attempt) {
    const Room& room = world.rooms[static_cast<std::size_t>(
        random.Integer(0, static_cast<int>(world.rooms.size()) - 1))];
    const Solid thing = RandomFurniture(room, placed + 1, random);
    if (!HasSpaceFor(thing, world)) continue;
    world.solids.push_back(thing);
    if (IsOnePiece(MakeClearanceMap(world), passage_m)) {
      ++placed;
    } else {
      world.solids.pop_back();
    }
  }
}

void LayDecals(Random& random, World& world) {
  for (const Room& room : world.rooms) {
    const Eigen::Vector2d size = room.max - room.min;
    if (random.Chance(0.45)) {
      Decal rug;
      rug.kind = Decal::Kind::kRug;
      rug.size = {random.Uniform(0.8, 1.8), random.Uniform(0.6, 1.3)};
      const Eigen::Vector2d middle =
          room.min + size.cwiseProduct(random.UniformIn({0.35, 0.35}, {0.65, 0.65}));
      rug.map_from_decal = {middle.x(), middle.y(), random.Uniform(-0.3, 0.3)};
      world.decals.push_back(rug);
    }
    if (random.Chance(0.5)) {
      Decal paper;
      paper.kind = Decal::Kind::kPaper;
      paper.size = {0.297, 0.210};
      const Eigen::Vector2d middle =
          room.min + size.cwiseProduct(random.UniformIn({0.2, 0.2}, {0.8, 0.8}));
      paper.map_from_decal = {middle.x(), middle.y(), random.Uniform(-3.1, 3.1)};
      world.decals.push_back(paper);
    }
  }
}

std::optional<Eigen::Vector2d> RandomFreePoint(const World& world, const ClearanceMap& map,
                                               double clearance_m, Random& random) {
  for (int attempt = 0; attempt < 2000; ++attempt) {
    const Eigen::Vector2d point = random.UniformIn(world.min, world.max);
    if (map.At(point) >= clearance_m) return point;
  }
  return std::nullopt;
}

// The robot where it has space to look round, the caller in another room.
// False where no such place was found.
bool PlaceRobotAndCaller(const WorldOptions& options, Random& random, World& world) {
  const ClearanceMap map = MakeClearanceMap(world);
  const auto free_start = RandomFreePoint(world, map, options.robot_radius_m + 0.3, random);
  if (!free_start) return false;
  const Eigen::Vector2d start = *free_start;
  const std::size_t start_room = RoomOf(world, start);
  double best_view_m = 0.0;
  for (int i = 0; i < 8; ++i) {  // of a few directions, that with the widest view
    const double heading = random.Uniform(-std::numbers::pi, std::numbers::pi);
    const double view_m = CastRay(world.solids, start, heading);
    if (view_m < best_view_m) continue;
    best_view_m = view_m;
    const Pose2 map_from_footprint{start.x(), start.y(), heading};
    world.map_from_robot = map_from_footprint * Pose2{-options.robot_centre_x_m, 0.0, 0.0};
  }
  const double caller_clear_m = kPersonRadiusM + 0.1;
  for (int attempt = 0; attempt < 500; ++attempt) {
    const auto free_place = RandomFreePoint(world, map, caller_clear_m, random);
    if (!free_place) return false;
    const Eigen::Vector2d caller = *free_place;
    const std::size_t room = RoomOf(world, caller);
    if (room == start_room || room == world.rooms.size()) continue;
    if ((caller - start).norm() < 3.0) continue;
    const bool beside_door =
        std::any_of(world.doors.begin(), world.doors.end(), [&](const Door& door) {
          return (door.centre - caller).norm() < kDoorClearM + kPersonRadiusM;
        });
    if (beside_door) continue;
    world.caller = caller;
    if (!options.caller_has_body) return true;
    world.solids.push_back(
        MakeCylinder("caller", SolidKind::kPerson, caller, kPersonRadiusM, kPersonHeightM));
    if (IsOnePiece(MakeClearanceMap(world), options.robot_radius_m + options.margin_m)) return true;
    world.solids.pop_back();
  }
  return false;
}

void SendPeopleWalking(const WorldOptions& options, Random& random, World& world) {
  const ClearanceMap map = MakeClearanceMap(world);
  const double clear_m = kPersonRadiusM + 0.1;
  for (int i = 0; i < options.walking_people; ++i) {
    WalkingPerson person;
    person.speed_mps = random.Uniform(0.4, 0.9);
    for (int attempt = 0; attempt < 1000 && person.waypoints.size() < 4; ++attempt) {
      const auto free_point = RandomFreePoint(world, map, clear_m, random);
      if (!free_point) return;
      const Eigen::Vector2d point = *free_point;
      if (person.waypoints.empty()) {
        if ((point - world.map_from_robot.translation()).norm() < 1.5) continue;
      } else {
        const Eigen::Vector2d& last = person.waypoints.back();
        if ((point - last).norm() < 1.2 || !map.LineIsFree(last, point, clear_m)) continue;
      }
      person.waypoints.push_back(point);
    }
    if (person.waypoints.size() >= 2) world.people.push_back(person);
  }
}

// One beacon in a corner of each room, a second one opposite in large rooms, and at least four in
// all.
void MountBeacons(Random& random, World& world) {
  const auto mount = [&](const Room& room, bool upper) {
    const double inset = 0.1;
    const double x = upper ? room.max.x() - inset : room.min.x() + inset;
    const double y = random.Uniform(room.min.y() + inset, room.max.y() - inset);
    char id[8];
    std::snprintf(id, sizeof(id), "%04X", static_cast<unsigned>(world.beacons.size() + 1));
    Beacon beacon;
    beacon.id = id;
    beacon.position = {0.01 * std::round(100.0 * x), 0.01 * std::round(100.0 * y),
                       0.01 * std::round(100.0 * random.Uniform(1.9, 2.3))};
    world.beacons.push_back(beacon);
  };
  const bool few_rooms = world.rooms.size() < 4;
  for (const Room& room : world.rooms) {
    const bool upper = random.Chance(0.5);
    mount(room, upper);
    if (few_rooms || (room.max - room.min).prod() > 14.0) mount(room, !upper);
  }
}

}  // namespace

World MakeWorld(std::uint64_t seed, const WorldOptions& options) {
  // Now and then a flat comes out too full to call from another room: then the next one is tried.
  for (std::uint64_t attempt = 0; attempt < 50; ++attempt) {
    World world;
    world.seed = seed;
    Random layout(seed, Stream::kLayout, attempt);
    LayOutRooms(options, layout, world);
    Random furniture(seed, Stream::kFurniture, attempt);
    Furnish(options, furniture, world);
    LayDecals(furniture, world);
    Random places(seed, Stream::kPlaces, attempt);
    if (!PlaceRobotAndCaller(options, places, world)) continue;
    MountBeacons(places, world);
    Random people(seed, Stream::kPeople, attempt);
    SendPeopleWalking(options, people, world);
    return world;
  }
  throw std::runtime_error("no flat comes out of seed " + std::to_string(seed));
}

ClearanceMap MakeClearanceMap(const World& world) {
  ClearanceMap map;
  map.grid = GridGeometry::Covering(world.min, world.max, kCellM);
  // A border of solid cells stands for the outer walls.
  cv::Mat free(map.grid.height + 2, map.grid.width + 2, CV_8UC1, cv::Scalar(0));
  for (int row = 0; row < map.grid.height; ++row) {
    for (int column = 0; column < map.grid.width; ++column) {
      free.at<std::uint8_t>(row + 1, column + 1) = 255;
    }
  }
  for (const Solid& solid : world.solids) {
    const double reach = solid.radius;
    const int first_row = std::max(0, map.grid.Row(solid.centre.y() - reach));
    const int last_row = std::min(map.grid.height - 1, map.grid.Row(solid.centre.y() + reach));
    const int first_column = std::max(0, map.grid.Column(solid.centre.x() - reach));
    const int last_column = std::min(map.grid.width - 1, map.grid.Column(solid.centre.x() + reach));
    for (int row = first_row; row <= last_row; ++row) {
      for (int column = first_column; column <= last_column; ++column) {
        if (Distance(solid, map.grid.Centre(column, row)) <= 0.0) {
          free.at<std::uint8_t>(row + 1, column + 1) = 0;
        }
      }
    }
  }
  cv::Mat cells;
  cv::distanceTransform(free, cells, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  // From centre to centre of cells; the solid begins half a cell earlier.
  map.distance_m =
      cv::max(0.0, kCellM * (cells(cv::Rect(1, 1, map.grid.width, map.grid.height)) - 0.5));
  return map;
}

double ClearanceMap::At(const Eigen::Vector2d& point) const {
  const int index = grid.IndexAt(point);
  return index < 0 ? 0.0 : distance_m.at<float>(index / grid.width, index % grid.width);
}

bool ClearanceMap::LineIsFree(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                              double radius_m) const {
  const double length = (to - from).norm();
  const int steps = static_cast<int>(std::ceil(length / (0.5 * grid.resolution_m)));
  for (int i = 0; i <= steps; ++i) {
    if (At(from + (to - from) * (static_cast<double>(i) / std::max(1, steps))) < radius_m)
      return false;
  }
  return true;
}

Site SiteOf(const World& world) {
  Site site;
  site.name = "simulated_" + std::to_string(world.seed);
  site.plan.min = world.min;
  site.plan.max = world.max;
  site.plan.outline = {
      world.min, {world.max.x(), world.min.y()}, world.max, {world.min.x(), world.max.y()}};
  site.plan.walls = world.inner_walls;
  for (const Solid& solid : world.solids) {
    // The outer walls are what the outline stands for.
    const bool inner = (solid.centre.array() > world.min.array()).all() &&
                       (solid.centre.array() < world.max.array()).all();
    if (solid.kind == SolidKind::kWall && inner) site.plan.obstacles.push_back(solid.footprint);
  }
  site.beacons = world.beacons;
  site.tag_height_m = kTagHeightM;
  site.window_s = 2.0;
  return site;
}

}  // namespace beckon::simulation
