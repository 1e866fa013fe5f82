// Missions as numbers and as pictures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/evaluation/navigation/mission.hpp"

namespace beckon {

// One object with the keys of the scoring, `runs` and `stops` (by reason) in it.
std::string MissionsAsJson(const std::vector<Mission>& missions);
std::string MissionsAsTable(const std::vector<Mission>& missions);
std::string MissionAsLine(const Mission& mission);

// Map, shortest way, way driven, and where it ended. Throws std::runtime_error when it cannot be
// written.
void DrawMission(const Mission& mission, const std::filesystem::path& file);

}  // namespace beckon
