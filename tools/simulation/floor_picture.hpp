// The floor of a flat as one picture: covering, rugs, papers, light and shadows.
#pragma once

#include <vector>

#include "tools/simulation/lighting.hpp"
#include "tools/simulation/texture.hpp"
#include "tools/simulation/world.hpp"

namespace beckon::simulation {

// Starts at world.min, rows along y. `floors`: one look a room.
MipImage PaintFloor(const World& world, const std::vector<Look>& floors, const Lighting& lighting,
                    double texel_m, Random& random);

}  // namespace beckon::simulation
