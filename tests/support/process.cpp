#include "tests/support/process.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace beckon::testing {
namespace {

constexpr std::chrono::milliseconds kPoll{10};

int ExitCodeFromStatus(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

Process::Process(const std::string& program, const std::vector<std::string>& arguments) {
  const std::string path = program.starts_with("/") ? program : (BinDir() / program).string();
  if (access(path.c_str(), X_OK) != 0) throw std::runtime_error("no program " + path);
  const std::string output = directory_.path() / "output";
  std::vector<char*> argv = {const_cast<char*>(path.c_str())};
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("fork failed");
  if (pid_ == 0) {
    const int file = open(output.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0600);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    execv(path.c_str(), argv.data());
    _exit(127);
  }
}

Process::~Process() {
  if (IsRunning()) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
}

void Process::Signal(int signal) const {
  if (exit_code_ < 0) kill(pid_, signal);
}

bool Process::IsRunning() {
  if (exit_code_ >= 0) return false;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return true;
  exit_code_ = ExitCodeFromStatus(status);
  return false;
}

int Process::WaitForExit(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (IsRunning()) {
    if (std::chrono::steady_clock::now() > deadline) {
      kill(pid_, SIGKILL);
      return -1;
    }
    std::this_thread::sleep_for(kPoll);
  }
  return exit_code_;
}

std::string Process::Output() const {
  std::ifstream file(directory_.path() / "output");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

bool Process::WaitForOutput(const std::string& text, std::chrono::milliseconds timeout) const {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (Output().find(text) == std::string::npos) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(kPoll);
  }
  return true;
}

Finished RunToEnd(const std::string& program, const std::vector<std::string>& arguments,
                  std::chrono::milliseconds timeout) {
  Process process(program, arguments);
  const int exit_code = process.WaitForExit(timeout);
  return {exit_code, process.Output()};
}

}  // namespace beckon::testing
