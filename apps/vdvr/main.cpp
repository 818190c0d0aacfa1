// vdvr: the command line. Finds the command in the table and runs it.
#include <fmt/format.h>

#include <string>
#include <vector>

#include "apps/common/completion.hpp"
#include "apps/common/manual.hpp"
#include "apps/vdvr/command.hpp"

namespace vdvr::cli {

const std::vector<Command>& commands() {
  static const std::vector<Command> table{
      {"devices", "[--probe]", "OpenCL devices, their limits, and which sampler they use", devices_command},
      {"simulate", "(--phantom NAME|FILE.json | --volume FILE) -o FILE.h5",
       "projections of a phantom or of a volume", simulate_command},
      {"info", "FILE", "what a file is: geometry, certificate, storage", info_command},
      {"center", "IN [-o SHEET.png]", "the centre of rotation, how sure it is, slices around it",
       center_command},
      {"reconstruct", "IN -o OUT", "uniform filtered back-projection", reconstruct_command},
      {"plan", "IN --epsilon E", "bounds, rates, storage, memory and time foreseen; builds nothing",
       plan_command},
      {"build", "IN --epsilon E -o OUT.vdvr", "the certified mixed-resolution volume", build_command},
      {"verify", "OUT.vdvr --projections IN", "measures a certificate again from scratch", verify_command},
      {"probe", "FILE --points P.csv -o V.csv", "values at points of a volume or of the exact field",
       probe_command},
      {"residual", "SCAN FILE -o OUT", "where no interpolation can explain the measured rays",
       residual_command},
      {"render", "FILE -o IMG.png", "a picture, or a turntable of pictures", render_command},
      {"serve", "FILE", "a volume in the browser, to be turned with the mouse", serve_command},
      {"export", "OUT.vdvr -o VOL", "a certified volume in the format of other programs", export_command},
      {"convert-geometry", "IN -o geometry.xml", "RTK's geometry file of a cone-beam scan",
       convert_geometry_command},
      {"run", "IN --epsilon E -o DIR", "plan, build, verify, render: everything from one scan", run_command},
      {"bench",
       "fbp|build|render ...",
       "timings, one JSON line per case",
       bench_command,
       "vdvr",
       {"fbp", "fdk", "build", "render", "bounds", "tune"}}};
  return table;
}

namespace {

constexpr const char* purpose =
    "X-ray CT projections and a tolerance in, a certified volume and pictures out";

void print_overview() {
  fmt::print("vdvr {}: {}\n\n", VDVR_VERSION, purpose);
  fmt::print(
      "usage: vdvr COMMAND [options]\n       vdvr COMMAND --help\n       vdvr --version\n       vdvr --man "
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

int dispatch(const std::vector<std::string>& words) {
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

}  // namespace
}  // namespace vdvr::cli

int main(int argc, char** argv) { return vdvr::cli::dispatch({argv + 1, argv + argc}); }
