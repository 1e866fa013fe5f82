// Drives as numbers.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/pose/drive.hpp"

namespace beckon {

std::string DriveAsLine(const PoseDrive& drive, const PoseDriveOptions& options);
std::string DrivesAsTable(const std::vector<PoseDrive>& drives, const PoseDriveOptions& options);
// One object with the numbers of the table, and `runs`, one object a drive.
std::string DrivesAsJson(const std::vector<PoseDrive>& drives, const PoseDriveOptions& options);

}  // namespace beckon
