// A simulated flat as the services know it: through the files of its site folder.
#pragma once

#include "services/rssi_localizer/localizer.hpp"
#include "tools/simulation/world.hpp"

namespace beckon {

// Writes the site with a calibration walk, reads it again, and fits the measurement model. Throws
// std::runtime_error where no temporary folder can be had.
SiteModel SurveyedSite(const simulation::World& world, const LocalizerOptions& options);

}  // namespace beckon
