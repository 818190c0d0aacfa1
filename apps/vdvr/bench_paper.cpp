// vdvr bench paper: every figure and table of the paper by our engine, the paper's numbers beside ours, as
// paper.html (one file), paper.json, CSV and PNG.
#include "apps/vdvr/bench_paper.hpp"

#include <fmt/format.h>

#include <chrono>

#include "apps/vdvr/paper.hpp"
#include "apps/vdvr/progress.hpp"
#include "vdvr/output_file.hpp"
#include "vdvr/error.hpp"
#include "vdvr/volume_file.hpp"

namespace vdvr::cli {
namespace {

/// Every file that any run may write; what a run does not make is only taken away.
std::vector<std::string> file_names() {
  std::vector<std::string> names;
  for (const char* table :
       {"claims", "speed", "figure-3", "figure-4", "figure-5", "figure-10", "figure-11", "figure-12",
        "figure-14", "table-1", "table-2-rms", "table-2-storage", "table-2-head"})
    names.push_back(std::string(table) + ".csv");
  for (const char* picture : {"figure-5-row", "figure-5-projection-spectrum", "figure-5-projection-map",
                              "figure-5-projection-product", "figure-5-volume-spectrum",
                              "figure-5-volume-map", "figure-5-volume-product", "figure-10", "figure-11",
                              "figure-12-function", "figure-12-field", "figure-13", "figure-14", "figure-15"})
    names.push_back(std::string(picture) + ".png");
  for (const char* plot : {"figure-3", "figure-4"}) names.push_back(std::string(plot) + ".svg");
  names.emplace_back("paper.html");
  names.emplace_back("paper.json");
  return names;
}

void measure(PaperRun& run) {
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

/// Whole or not at all: what an interruption or a full disk leaves is taken away again. paper.json comes last
/// and says that the folder is complete.
void write_report(const PaperRun& run, OutputFolder& folder) {
  folder.begin();
  try {
    for (const auto& section : run.page.sections) {
      for (const auto& table : section.tables) io::write_file(folder.file(table.name + ".csv"), csv(table));
      for (const auto& picture : section.pictures)
        write_png(folder.file(picture.name + ".png"), picture.image);
      for (const auto& plot : section.plots) io::write_file(folder.file(plot.name + ".svg"), plot.svg);
      throw_if_stopped();
    }
    io::write_file(folder.file("paper.html"), html(run.page));
    io::write_file(folder.file("paper.json"), run.json.dump(2) + "\n");
  } catch (...) {
    folder.begin();
    throw;
  }
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
  fmt::print("everything in  {}\n", (output / "paper.html").string());
}

}  // namespace

int bench_paper(Arguments& args) {
  args.value("output,o", "DIR", "the folder for paper.html, paper.json, CSV and PNG files")
      .flag("quick", "fewer points, views, frames and thresholds: minutes instead of a quarter of an hour")
      .value("head", "FILE.mha",
             "the head of scripts/fetch-head, for Fig. 14 and the rows of carp and beetle");
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const auto output = args.path("output");
  std::optional<std::filesystem::path> head;
  if (args.has("head")) head = args.path("head");
  OutputFolder folder(output, file_names(), common.force);
  if (head) check_head(*head, common.max_memory);
  Device device = open_device(common);
  ProgressLine line(args.command(), common.quiet);
  const auto start = std::chrono::steady_clock::now();
  PaperRun run{device, line.callback(), args.has("quick"), head, common.max_memory};
  const DeviceInfo& info = device.info();
  const std::string command = fmt::format("vdvr bench paper{}{}", run.quick ? " --quick" : "",
                                          head ? " --head " + head->filename().string() : "");
  run.json = {{"command", command},    {"version", VDVR_VERSION}, {"device", info.name},
              {"driver", info.driver}, {"quick", run.quick},      {"table_1", Json::array()}};
  measure(run);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.json["seconds"] = seconds;
  run.page.title = "VDVR: the paper's figures and tables, measured again";
  run.page.introduction = {
      fmt::format("Made by {} (version {}) on {}, driver {}, in {}.", command, VDVR_VERSION, info.name,
                  info.driver, duration(seconds)),
      "The paper is \"VDVR: Verifiable Visualization of Projection-Based Data\". Its numbers stand beside "
      "those of this run; \"paper's settings\" is this engine with the options of --paper. "
      "F is the field that filtered back-projection with ideal interpolation of the projections defines; the "
      "function is the phantom itself."};
  throw_if_stopped();
  write_report(run, folder);
  line.clear();
  print_result(common, run.json, [&] { print_claims(run.json, output); });
  return 0;
}

}  // namespace vdvr::cli
