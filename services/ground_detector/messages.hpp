// What was found in a frame, as messages.
#pragma once

#include <beckon/ground_t.hpp>
#include <beckon/planar_motion_t.hpp>

#include "services/ground_detector/ground_detector.hpp"

namespace beckon {

// At most this many bytes of runs, so that the message fits one datagram.
inline constexpr std::size_t kMaxRunBytes = 60'000;

// Labels too ragged for kMaxRunBytes are taken on ever coarser grids until they fit: a square is
// ground only if all of it is, and not ground if any of it is.
ground_t MakeGroundMessage(const GroundFrame& frame);
planar_motion_t MakeMotionMessage(const GroundFrame& frame);

}  // namespace beckon
