// Logging to stderr, one line an event, with time, level and program name. A thin front of spdlog,
// so that its templates are compiled once.
#pragma once

#include <string>
#include <string_view>

namespace beckon {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

// Names the program in every line and sets the least level that is shown.
void StartLogging(const std::string& program, LogLevel least);

void Log(LogLevel level, std::string_view message);
inline void LogDebug(std::string_view message) { Log(LogLevel::kDebug, message); }
inline void LogInfo(std::string_view message) { Log(LogLevel::kInfo, message); }
inline void LogWarning(std::string_view message) { Log(LogLevel::kWarning, message); }
inline void LogError(std::string_view message) { Log(LogLevel::kError, message); }

}  // namespace beckon
