// vdvr-paper: every figure and table of the paper by our engine, the paper's numbers beside ours, as
// paper.json, CSV, NumPy fields and PNG. scripts/paper-page draws figures and page from them.
#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "apps/common/command.hpp"
#include "apps/common/completion.hpp"
#include "apps/common/manual.hpp"
#include "apps/common/progress.hpp"
#include "apps/paper/report.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/volume_file.hpp"

namespace vdvr::paper {
namespace {

void measure(Report& run) {
  add_projection_errors(run);
  const Lobb lobb = measure_lobb(run);
  add_thresholds(run, lobb);
  measure_lobb_speeds(run, lobb);
  add_error_maps(run, lobb);
  add_equal_samples(run, lobb);
  add_lobb_pictures(run, lobb);
  add_tumours(run);
  add_objects(run, lobb);
  add_speeds(run);
  add_claims(run);
}

/// The head's turn comes after minutes: a file that cannot be read is refused before them. It is read again
/// then, since the other sections need the memory.
void check_head(const std::filesystem::path& head, std::uint64_t max_memory) {
  try {
    (void)read_volume(head, max_memory);
  } catch (const FileError& e) {
    throw InputError(fmt::format("--head: {}; scripts/fetch-head makes head.mha", e.what()));
  }
}

void print_claims(const Json& json, const std::filesystem::path& output) {
  for (const auto& c : json["claims"])
    fmt::print("{:<15} {:<22} {}: {}\n", c["verdict"].get<std::string>(), c["where"].get<std::string>(),
               c["paper"].get<std::string>(), c["found"].get<std::string>());
  fmt::print("everything in  {}; scripts/paper-page {} draws the page\n", output.string(), output.string());
}

int run(cli::Arguments& args) {
  args.value("output,o", "DIR", "the folder for paper.json, CSV, NumPy and PNG files")
      .flag("quick",
            "fewer points, views, frames and thresholds: two minutes instead of a quarter of an hour")
      .value("head", "FILE.mha",
             "the head of scripts/fetch-head, for Fig. 14 and the rows of carp and beetle");
  cli::add_common(args);
  if (!args.parse()) return 0;
  const cli::CommonOptions common = cli::common_options(args);
  const auto output = args.path("output");
  std::optional<std::filesystem::path> head;
  if (args.has("head")) head = args.path("head");
  cli::OutputFolder folder(output, file_names(), common.force);
  if (head) check_head(*head, common.max_memory);
  Device device = cli::open_device(common);
  cli::ProgressLine line(args.who(), common.quiet);
  const auto start = std::chrono::steady_clock::now();
  Report report{device, line.callback(), args.has("quick"), head, common.max_memory};
  const DeviceInfo& info = device.info();
  report.json = {{"command", fmt::format("vdvr-paper{}{}", report.quick ? " --quick" : "",
                                         head ? " --head " + head->filename().string() : "")},
                 {"version", VDVR_VERSION},
                 {"device", info.name},
                 {"driver", info.driver},
                 {"quick", report.quick},
                 {"table_1", Json::array()}};
  measure(report);
  report.json["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  throw_if_stopped();
  write_report(report, folder);
  line.clear();
  cli::print_result(common, report.json, [&] { print_claims(report.json, output); });
  return 0;
}

}  // namespace
}  // namespace vdvr::paper

int main(int argc, char** argv) {
  const vdvr::cli::Command command{"", "-o DIR [--quick] [--head FILE.mha]",
                                   "every figure and table of the paper, measured again", vdvr::paper::run,
                                   "vdvr-paper"};
  const std::vector<std::string> words{argv + 1, argv + argc};
  if (words == std::vector<std::string>{"--version"}) {
    fmt::print("vdvr-paper {}\n", VDVR_VERSION);
    return 0;
  }
  if (words == std::vector<std::string>{"--man"}) {
    fmt::print("{}", vdvr::cli::command_page(command));
    return 0;
  }
  if (words == std::vector<std::string>{"--completion", "bash"}) {
    fmt::print("{}", vdvr::cli::bash_completion("vdvr-paper", {command}));
    return 0;
  }
  return vdvr::cli::run_guarded(command, words);
}
