// vdvr-mpi: plan, build, verify, render and run as ranks of an MPI job (docs/scaling.md). Rank 0 is the
// program `vdvr` with the other ranks at hand; these compute blocks until it is done.
#include <fmt/format.h>
#include <mpi.h>

#include <algorithm>
#include <exception>
#include <string>
#include <vector>

#include "apps/common/completion.hpp"
#include "apps/common/manual.hpp"
#include "apps/common/progress.hpp"
#include "apps/mpi/mpi_messenger.hpp"
#include "apps/vdvr/command.hpp"
#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/frames.hpp"

namespace vdvr::cli {
namespace {

constexpr const char* program = "vdvr-mpi";
constexpr const char* purpose = "certified volumes, computed by all ranks of an MPI job";

// Of all commands those that know what to do with other ranks, or are wanted beside them.
std::vector<Command> commands_of_ranks() {
  std::vector<Command> out;
  for (Command command : commands()) {
    const std::string name = command.name;
    if (name != "plan" && name != "build" && name != "verify" && name != "run" && name != "render") continue;
    command.program = program;
    out.push_back(command);
  }
  return out;
}

int lead(const std::vector<std::string>& words) {
  static const std::vector<Command> known = commands_of_ranks();
  if (words.empty() || words[0] == "--help" || words[0] == "-h") {
    fmt::print("vdvr-mpi {}: {}\n\nusage: mpirun -n N vdvr-mpi COMMAND [options]\n\ncommands:\n",
               VDVR_VERSION, purpose);
    for (const Command& c : known) fmt::print("  {:<16} {}\n", c.name, c.purpose);
    fmt::print(
        "\nbuild and run spread their blocks over all ranks, render the frames of a turntable in a folder; "
        "plan, "
        "verify and single pictures are rank 0's alone.\n");
    return words.empty() ? 2 : 0;
  }
  if (words[0] == "--version") {
    fmt::print("vdvr-mpi {}\n", VDVR_VERSION);
    return 0;
  }
  if (words[0] == "--man") {
    fmt::print("{}", overview_page(program, purpose, known));
    return 0;
  }
  for (const Command& command : known)
    if (words[0] == command.name) return run_guarded(command, {words.begin() + 1, words.end()});
  return fail(program, fmt::format("unknown command '{}'; `vdvr-mpi --help` lists them", words[0]), 2);
}

// Frames that this rank does not draw rank 0 will, and say why it could not.
int follow_render(MpiMessenger& messenger, std::vector<std::string> words) {
  static const std::vector<Command> known = commands_of_ranks();
  if (!wait_for_frames(messenger)) return 0;
  set_messenger(&messenger);
  follow_frames(messenger, messenger.rank());
  std::erase(words, "--json");
  words.emplace_back("--quiet");
  for (const Command& command : known)
    if (words[0] == command.name) run_guarded(command, {words.begin() + 1, words.end()});
  end_frames(messenger);
  return 0;
}

// What a rank could not do, rank 0 has said, and has given to others.
int follow(MpiMessenger& messenger, const std::vector<std::string>& words) {
  try {
    if (!words.empty() && words[0] == "render") return follow_render(messenger, words);
    serve(messenger);
    return 0;
  } catch (const std::exception& e) {
    say(fmt::format("vdvr-mpi, rank {}: {}\n", messenger.rank(), e.what()));
    return 0;
  }
}

int run(const std::vector<std::string>& words) {
  int code = 0;
  bool lost = false;
  {
    MpiMessenger messenger;
    if (messenger.rank() != 0) {
      code = follow(messenger, words);
    } else {
      if (messenger.others() > 0) set_messenger(&messenger);
      code = lead(words);
      dismiss(messenger);
    }
    messenger.flush();
    messenger.part();
    lost = messenger.lost_any();
  }
  // Ranks that are gone, or hang, would be waited for.
  if (lost) MPI_Abort(MPI_COMM_WORLD, code);
  MPI_Finalize();
  return code;
}

}  // namespace
}  // namespace vdvr::cli

int main(int argc, char** argv) {
  int provided = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  return vdvr::cli::run({argv + 1, argv + argc});
}
