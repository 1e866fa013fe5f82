// Rooms, walls and doors of a random flat.
#pragma once

#include "tools/simulation/random.hpp"
#include "tools/simulation/world.hpp"

namespace beckon::simulation {

// Fills the world's extent, rooms, doors, inner walls, and the walls among its solids. The rooms
// form a tree: each wall that divides has one door, so that every room can be reached.
void LayOutRooms(const WorldOptions& options, Random& random, World& world);

}  // namespace beckon::simulation
