// A program of ours, run as a user would run it.
#pragma once

#include <sys/types.h>
#include <chrono>
#include <string>
#include <vector>

#include "tests/support/support.hpp"

namespace beckon::testing {

class Process {
 public:
  // Starts build/bin/PROGRAM (or an absolute path); stdout and stderr go to a file.
  Process(const std::string& program, const std::vector<std::string>& arguments);
  // Kills it if it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void Signal(int signal) const;
  bool IsRunning();
  // Exit code, 128 + signal for one that was killed, -1 when it does not end in time (it is then
  // killed).
  int WaitForExit(std::chrono::milliseconds timeout = std::chrono::seconds(10));
  // All that it wrote so far.
  std::string Output() const;
  // True as soon as its output holds the text.
  bool WaitForOutput(const std::string& text,
                     std::chrono::milliseconds timeout = std::chrono::seconds(10)) const;

 private:
  TempDir directory_;
  pid_t pid_ = -1;
  int exit_code_ = -1;
};

// Runs a program to its end.
struct Finished {
  int exit_code;
  std::string output;
};
Finished RunToEnd(const std::string& program, const std::vector<std::string>& arguments,
                  std::chrono::milliseconds timeout = std::chrono::seconds(60));

}  // namespace beckon::testing
