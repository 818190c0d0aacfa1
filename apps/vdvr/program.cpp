#include "apps/vdvr/program.hpp"

#include <fmt/format.h>

#include <string>
#include <vector>

#include "apps/common/completion.hpp"
#include "apps/common/manual.hpp"
#include "apps/vdvr/command.hpp"

namespace vdvr::cli {

namespace {

constexpr const char* purpose =
    "X-ray CT projections and a tolerance in, a certified volume and pictures out";

void print_overview() {
  fmt::print("vdvr {}: {}\n\n", VDVR_VERSION, purpose);
  fmt::print(
      "usage: vdvr COMMAND [options]\n       vdvr COMMAND --help | --help-all\n       vdvr --version\n       "
      "vdvr --man "
      "[COMMAND]\n"
      "       vdvr --completion bash\n\ncommands:\n");
  for (const Command& c : commands()) fmt::print("  {:<16} {}\n", c.name, c.purpose);
}

/// The page of the command that is named, or of the program.
int print_manual(const std::vector<std::string>& words) {
  if (words.size() == 1) {
    fmt::print("{}", overview_page("vdvr", purpose, commands()));
    return 0;
  }
  for (const Command& command : commands())
    if (words[1] == command.name) {
      fmt::print("{}", command_page(command));
      return 0;
    }
  return fail("vdvr", fmt::format("--man: unknown command '{}'; `vdvr --help` lists them", words[1]), 2);
}

int print_completion(const std::vector<std::string>& words) {
  if (words.size() != 2 || words[1] != "bash")
    return fail("vdvr", "--completion: name the shell; there is one for bash", 2);
  fmt::print("{}", bash_completion("vdvr", commands()));
  return 0;
}

}  // namespace

int run_program(const std::vector<std::string>& words) {
  if (words.empty()) {
    print_overview();
    return 2;
  }
  if (words[0] == "--help" || words[0] == "-h" || words[0] == "help") {
    print_overview();
    return 0;
  }
  if (words[0] == "--version") {
    fmt::print("vdvr {}\n", VDVR_VERSION);
    return 0;
  }
  if (words[0] == "--man") return print_manual(words);
  if (words[0] == "--completion") return print_completion(words);
  for (const Command& command : commands())
    if (words[0] == command.name) return run_guarded(command, {words.begin() + 1, words.end()});
  return fail("vdvr", fmt::format("unknown command '{}'; `vdvr --help` lists them", words[0]), 2);
}

}  // namespace vdvr::cli
