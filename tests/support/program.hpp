// Runs the program itself in a child process with an environment, limits and streams of the test's choice.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/support/places.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vdvr::support {

struct Ended {
  int code = -1;  ///< exit code, or 1000 + the signal that killed it
  std::string out, err;
};

class Program {
 public:
  /// stdout and stderr go to files in `folder`.
  explicit Program(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::string binary = vdvr_binary;
  /// Environment of the next runs, beside the test's own.
  std::map<std::string, std::string> environment;
  /// Called in the child before the program takes over.
  std::function<void()> prepare = [] {};

  [[nodiscard]] pid_t start(const std::vector<std::string>& words, const std::string& name = "std") const {
    std::vector<std::string> all{binary};
    all.insert(all.end(), words.begin(), words.end());
    std::vector<char*> argv;
    std::transform(all.begin(), all.end(), std::back_inserter(argv), [](std::string& s) { return s.data(); });
    argv.push_back(nullptr);
    const std::string out = (folder_ / (name + ".out")).string(), err = (folder_ / (name + ".err")).string();
    const pid_t child = ::fork();
    if (child == 0) {
      ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
      ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
      for (const auto& [key, value] : environment) ::setenv(key.c_str(), value.c_str(), 1);
      prepare();
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    return child;
  }
  [[nodiscard]] Ended finish(pid_t child, const std::string& name = "std") const {
    int status = 0;
    ::waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status),
            bytes_of(folder_ / (name + ".out")), bytes_of(folder_ / (name + ".err"))};
  }
  [[nodiscard]] Ended run(const std::vector<std::string>& words) const { return finish(start(words)); }

 private:
  std::filesystem::path folder_;
};

}  // namespace vdvr::support
