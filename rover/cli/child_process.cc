#include "rover/cli/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "rover/base/error.h"
#include "rover/base/stopwatch.h"

namespace rover {
namespace {

constexpr int kNotStarted = 127;  // as shells say it

// In the child, between fork and exec: only calls that are safe there.
[[noreturn]] void become(const char* program, char* const* argv, int log) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(program, argv);
  _exit(kNotStarted);
}

int wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return kNotStarted;
  }
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace

ChildOutcome run_child(const std::filesystem::path& program,
                       const std::vector<std::string>& arguments,
                       const std::filesystem::path& log) {
  std::vector<char*> argv;
  std::string name = program.string();
  std::vector<std::string> words = arguments;
  argv.push_back(name.data());
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  require(file >= 0, "{}: cannot be written ({})", log.string(), std::strerror(errno));
  Stopwatch watch;
  const pid_t child = fork();
  if (child == 0) become(name.c_str(), argv.data(), file);
  close(file);
  require(child > 0, "no process can be started ({})", std::strerror(errno));
  const int status = wait_for(child);
  return {status, watch.lap_ms() / 1000};
}

}  // namespace rover
