// What a program does with its words, and how it ends. Called by the main.cpp of each program.
#pragma once

#include <string>
#include <vector>

namespace vdvr::cli {

class Arguments;

/// A line that a user may type, and what comes of it.
struct Example {
  const char* line;
  const char* effect;
};

struct Command {
  const char* name;     ///< "build"; empty for a program that does one thing
  const char* usage;    ///< what follows the name on the usage line
  const char* purpose;  ///< one line
  int (*run)(Arguments& args);
  const char* program = "vdvr";
  std::vector<std::string> cases = {};  ///< words of which one comes first, each with options of its own
  /// Options that --help explains, at most ten; where none is named, all. The others are for --help-all.
  std::vector<std::string> main_options = {};
  std::vector<Example> examples = {};

  /// "vdvr build": what stands before messages.
  [[nodiscard]] std::string who() const { return std::string(program) + (*name ? " " : "") + name; }
};

/// Runs the command under handlers of signals and turns what it throws into a message and an exit code: 0
/// done, 1 mismatch or tolerance out of reach, 2 bad usage or input, 3 device or resource, 130/143
/// interrupted.
int run_guarded(const Command& command, std::vector<std::string> words);

/// Says why on stderr, "interrupted" once a stop was requested; the exit code.
int fail(const std::string& who, std::string message, int code);

}  // namespace vdvr::cli
