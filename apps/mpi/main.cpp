// vdvr-mpi: plan, build, verify, render and run as ranks of an MPI job (docs/scaling.md). Rank 0 is the
// program `vdvr` with the other ranks at hand; these compute blocks until it is done.
#include <fmt/format.h>
#include <mpi.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <exception>
#include <optional>
#include <string>
#include <thread>
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

const std::vector<Command>& known() {
  static const std::vector<Command> all = commands_of_ranks();
  return all;
}

void print_overview() {
  fmt::print(
      "vdvr-mpi {}: {}\n\nusage: mpirun -n N vdvr-mpi COMMAND [options]\n       vdvr-mpi COMMAND --help\n\n"
      "commands:\n",
      VDVR_VERSION, purpose);
  for (const Command& c : known()) fmt::print("  {:<16} {}\n", c.name, c.purpose);
  fmt::print(
      "\nbuild and run spread their blocks over all ranks, render the frames of a turntable in a folder; "
      "plan,\n"
      "verify and single pictures are rank 0's alone.\n"
      "Options are those of vdvr, whose man pages have them: man vdvr-build.\n");
}

// The options are those of the program of one process, and so are the pages.
int print_manual(const std::vector<std::string>& words) {
  if (words.size() > 1)
    return fail(program, fmt::format("--man: there is one page; `vdvr --man {}` has the options", words[1]),
                2);
  std::vector<Command> documented = known();
  for (Command& c : documented) c.program = "vdvr";
  fmt::print("{}", overview_page(program, purpose, documented));
  return 0;
}

int print_completion(const std::vector<std::string>& words) {
  if (words.size() != 2 || words[1] != "bash")
    return fail(program, "--completion: name the shell; there is one for bash", 2);
  fmt::print("{}", bash_completion(program, known()));
  return 0;
}

// What needs no other rank, and no MPI: a launcher's ranks but the first say nothing.
std::optional<int> answer_alone(const std::vector<std::string>& words) {
  const std::string word = words.empty() ? "" : words[0];
  const bool help = word == "--help" || word == "-h" || word == "help";
  if (!words.empty() && !help && word != "--version" && word != "--man" && word != "--completion")
    return std::nullopt;
  const int code = words.empty() ? 2 : 0;
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID"})
    if (const char* rank = std::getenv(name); rank != nullptr && std::string(rank) != "0") return code;
  if (word == "--man") return print_manual(words);
  if (word == "--completion") return print_completion(words);
  if (word == "--version") fmt::print("vdvr-mpi {}\n", VDVR_VERSION);
  else print_overview();
  return code;
}

int lead(const std::vector<std::string>& words) {
  for (const Command& command : known())
    if (words[0] == command.name) return run_guarded(command, {words.begin() + 1, words.end()});
  return fail(program, fmt::format("unknown command '{}'; `vdvr-mpi --help` lists them", words[0]), 2);
}

// Frames that this rank does not draw rank 0 will, and say why it could not.
int follow_render(MpiMessenger& messenger, std::vector<std::string> words) {
  if (!wait_for_frames(messenger)) return 0;
  set_messenger(&messenger);
  follow_frames(messenger, messenger.rank());
  std::erase(words, "--json");
  words.emplace_back("--quiet");
  for (const Command& command : known())
    if (words[0] == command.name) run_guarded(command, {words.begin() + 1, words.end()});
  end_frames(messenger);
  return 0;
}

// What a rank could not do, rank 0 has said, and has given to others.
int follow(MpiMessenger& messenger, const std::vector<std::string>& words) {
  try {
    if (!words.empty() && words[0] == "render") return follow_render(messenger, words);
    join_crew(messenger);
    return 0;
  } catch (const std::exception& e) {
    say(fmt::format("vdvr-mpi, rank {}: {}\n", messenger.rank(), e.what()));
    return 0;
  }
}

// Rank 0, whose work is done, does not wait for ever; the others wait for it, which may still be writing.
bool part_from_others(MpiMessenger& messenger) {
  if (messenger.rank() != 0) return messenger.part(std::nullopt);
  if (messenger.part(patience_with_others())) return true;
  if (!messenger.lost_any())
    say(fmt::format("vdvr-mpi: a rank gave no sign for {} s at the end; the job is ended without it\n",
                    patience_with_others().count()));
  return false;
}

// A rank that hangs while MPI ends is waited for by MPI, but not by this process, whose output is in place.
void end_after(std::chrono::seconds patience, int code) {
  std::thread([patience, code] {
    std::this_thread::sleep_for(patience);
    ::_exit(code);
  }).detach();
}

int run(const std::vector<std::string>& words) {
  int code = 0;
  bool lost = false, leads = false;
  {
    MpiMessenger messenger;
    leads = messenger.rank() == 0;
    if (!leads) {
      code = follow(messenger, words);
    } else {
      if (messenger.others() > 0) set_messenger(&messenger);
      code = lead(words);
      dismiss(messenger);
    }
    messenger.flush();
    lost = !part_from_others(messenger);
  }
  // Ranks that are gone, or hang, would be waited for.
  if (lost) MPI_Abort(MPI_COMM_WORLD, code);
  if (leads) end_after(patience_with_others(), code);
  MPI_Finalize();
  return code;
}

}  // namespace
}  // namespace vdvr::cli

int main(int argc, char** argv) {
  if (const auto code = vdvr::cli::answer_alone({argv + 1, argv + argc})) return *code;
  int provided = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  return vdvr::cli::run({argv + 1, argv + argc});
}
