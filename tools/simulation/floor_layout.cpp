#include "tools/simulation/floor_layout.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace beckon::simulation {
namespace {

constexpr double kMinRoomM = 2.5;  // least side of a room
constexpr double kDoorFromCornerM = 0.3;
constexpr double kOuterWallM = 0.2;  // thickness

// A cut through a room: at `at` along `axis` (0: x, 1: y), with a door somewhere along the other
// axis.
struct Cut {
  int axis;
  double at;
  double door;  // middle of it, along the other axis
  double door_width_m;
};

// The wall of a new cut must not end in a door of a wall that is already there.
bool EndsClearOfDoors(const Room& room, const Cut& cut, double thickness_m,
                      const std::vector<Door>& doors) {
  for (const double end : {room.min[1 - cut.axis], room.max[1 - cut.axis]}) {
    Eigen::Vector2d point;
    point[cut.axis] = cut.at;
    point[1 - cut.axis] = end;
    for (const Door& door : doors) {
      if ((point - door.centre).norm() < 0.5 * door.width_m + thickness_m + kDoorFromCornerM)
        return false;
    }
  }
  return true;
}

std::optional<Cut> FindCut(const Room& room, double thickness_m, const std::vector<Door>& doors,
                           Random& random) {
  const Eigen::Vector2d size = room.max - room.min;
  for (int attempt = 0; attempt < 30; ++attempt) {
    Cut cut{};
    cut.axis = size.x() > size.y() ? 0 : 1;
    if (random.Chance(0.2)) cut.axis = 1 - cut.axis;
    const double room_to_cut = size[cut.axis] - thickness_m - 2.0 * kMinRoomM;
    if (room_to_cut < 0.0) continue;
    cut.at = room.min[cut.axis] + kMinRoomM + 0.5 * thickness_m + room_to_cut * random.Uniform();
    cut.door_width_m = random.Uniform(0.8, 1.0);
    const double from_corner = kDoorFromCornerM + 0.5 * cut.door_width_m;
    cut.door =
        random.Uniform(room.min[1 - cut.axis] + from_corner, room.max[1 - cut.axis] - from_corner);
    if (EndsClearOfDoors(room, cut, thickness_m, doors)) return cut;
  }
  return std::nullopt;
}

void AddWall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double thickness_m,
             World& world) {
  const Eigen::Vector2d along = to - from;
  const Eigen::Vector2d middle = 0.5 * (from + to);
  const Pose2 map_from_wall{middle.x(), middle.y(), std::atan2(along.y(), along.x())};
  const std::string name = "wall " + std::to_string(world.solids.size() + 1);
  world.solids.push_back(
      MakeBox(name, SolidKind::kWall, map_from_wall, {along.norm(), thickness_m}, kWallHeightM));
}

void AddInnerWall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, World& world) {
  Wall wall;
  wall.from = from;
  wall.to = to;
  world.inner_walls.push_back(wall);
  AddWall(from, to, world.inner_wall_thickness_m, world);
}

void Apply(const Cut& cut, std::size_t room_index, World& world) {
  const Room room = world.rooms[room_index];
  const int across = 1 - cut.axis;
  const auto point = [&](double along_wall) {
    Eigen::Vector2d result;
    result[cut.axis] = cut.at;
    result[across] = along_wall;
    return result;
  };
  AddInnerWall(point(room.min[across]), point(cut.door - 0.5 * cut.door_width_m), world);
  AddInnerWall(point(cut.door + 0.5 * cut.door_width_m), point(room.max[across]), world);
  world.doors.push_back({point(cut.door), cut.door_width_m});
  Room second = room;
  world.rooms[room_index].max[cut.axis] = cut.at - 0.5 * world.inner_wall_thickness_m;
  second.min[cut.axis] = cut.at + 0.5 * world.inner_wall_thickness_m;
  world.rooms.push_back(second);
}

void AddOuterWalls(World& world) {
  const Eigen::Vector2d corners[] = {
      world.min, {world.max.x(), world.min.y()}, world.max, {world.min.x(), world.max.y()}};
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d from = corners[i];
    const Eigen::Vector2d to = corners[(i + 1) % 4];
    const Eigen::Vector2d along = (to - from).normalized();
    const Eigen::Vector2d outward = 0.5 * kOuterWallM * Eigen::Vector2d(along.y(), -along.x());
    AddWall(from + outward - kOuterWallM * along, to + outward + kOuterWallM * along, kOuterWallM,
            world);
  }
}

// Divides the flat until it has that many rooms; false where there is no place for another wall.
bool Divide(int rooms, Random& random, World& world) {
  while (static_cast<int>(world.rooms.size()) < rooms) {
    // The largest room that can be cut is cut.
    std::vector<std::size_t> order(world.rooms.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return (world.rooms[a].max - world.rooms[a].min).prod() >
             (world.rooms[b].max - world.rooms[b].min).prod();
    });
    bool done = false;
    for (std::size_t i = 0; i < order.size() && !done; ++i) {
      const auto cut =
          FindCut(world.rooms[order[i]], world.inner_wall_thickness_m, world.doors, random);
      if (cut) Apply(*cut, order[i], world);
      done = cut.has_value();
    }
    if (!done) return false;
  }
  return true;
}

}  // namespace

void LayOutRooms(const WorldOptions& options, Random& random, World& world) {
  const int rooms = random.Integer(options.min_rooms, options.max_rooms);
  double room_area_m2 = random.Uniform(11.0, 16.0);
  const World empty = world;
  do {
    world = empty;
    const double area_m2 = rooms * room_area_m2;
    const double aspect = random.Uniform(1.0, 1.6);
    const auto centimetres = [](double metres) { return 0.01 * std::round(100.0 * metres); };
    world.min = Eigen::Vector2d::Zero();
    world.max = {centimetres(std::sqrt(area_m2 * aspect)),
                 centimetres(std::sqrt(area_m2 / aspect))};
    world.inner_wall_thickness_m = random.Uniform(0.08, 0.14);
    AddOuterWalls(world);
    world.rooms.push_back({world.min, world.max});
    room_area_m2 *= 1.05;  // what does not fit gets more space
  } while (!Divide(rooms, random, world));
}

}  // namespace beckon::simulation
