// vdvr build: the certified volume.
#include "vdvr/expert/build.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/common/progress.hpp"
#include "apps/vdvr/certify.hpp"
#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/output.hpp"

namespace vdvr::cli {

namespace {

int build_file(const Arguments& args, const CommonOptions& common, Wanted wanted,
               const std::filesystem::path& output, Journals& journals) {
  Devices devices(args, common);
  Device& device = devices.first();
  wanted.options.build.crew = devices.crew();
  ProgressLine progress(args.who(), common.quiet);
  std::map<std::string, double> seconds;
  Planned planned =
      timed(seconds, "plan", [&] { return read_and_plan(device, args, wanted, progress.callback()); });
  const BuildResult result = build_planned(device, planned, wanted, progress.callback());
  seconds.insert(result.seconds.begin(), result.seconds.end());
  throw_if_stopped();
  write_vdvr(output, result.volume, result.certificate, wanted.compression);
  journals.remove();
  progress.clear();

  const std::uint64_t bytes = std::filesystem::file_size(output);
  const Json json = {{"output", output.string()},
                     {"grid", grid_json(result.volume.grid)},
                     {"bricks", levels_json(result.volume)},
                     {"storage", storage_json(result.volume, bytes)},
                     {"resumed", {{"records", journals.replayed()}, {"shares", journals.parts.size()}}},
                     {"peak_bytes", devices.peak_memory()},
                     {"messages", {{"bytes", result.message_bytes}, {"seconds", result.message_seconds}}},
                     {"pictures", pictures_json(planned)},
                     {record_name(result.certificate), certificate_json(result.certificate)},
                     {"seconds", seconds_json(seconds)}};
  print_result(common, json, [&] {
    print_scan(planned.scan);
    print_grid(result.volume.grid);
    print_certificate(result.certificate);
    print_pictures(planned);
    print_storage(result.volume, bytes);
    print_seconds(seconds);
    fmt::print("written        {}\n", output.string());
  });
  return std::max(pictures_exit_code(args.who(), planned),
                  certificate_exit_code(args.who(), result.certificate));
}

// A part of the blocks, into a journal that --resume of the whole joins.
int build_part(const Arguments& args, const CommonOptions& common, Wanted wanted,
               const std::filesystem::path& output, const BuildShare& share, Journal& journal) {
  Devices devices(args, common);
  wanted.options.build.journal = &journal;
  wanted.options.build.crew = devices.crew();
  ProgressLine progress(args.who(), common.quiet);
  wanted.noted_noise = false;
  Planned planned = read_and_plan(devices.first(), args, wanted, progress.callback());
  if (auto refinement = refinement_of(planned.made)) wanted.options.build.refinement = std::move(*refinement);
  build_share(devices.first(), planned.scan, std::move(planned.made.plan), wanted.options.build, share,
              progress.callback());
  progress.clear();
  const Json json = {{"journal", journal.path().string()},
                     {"share", {{"part", share.part}, {"parts", share.parts}}},
                     {"records", journal.records()},
                     {"resumed", {{"records", journal.replayed()}}},
                     {"peak_bytes", devices.peak_memory()}};
  print_result(common, json, [&] {
    fmt::print("share          {} of {}: {} records\n", share.part, share.parts, journal.records());
    fmt::print("written        {}\n", journal.path().string());
    fmt::print("join           the same command with --resume and without --share writes {}\n",
               output.string());
  });
  return 0;
}

}  // namespace

int build_command(Arguments& args) {
  args.positional("IN", "projections").value("output,o", "OUT.vdvr", "the certified volume to write");
  args.value("share", "K/N",
             "classify part K of N into a journal beside the output; once all are there, --resume without "
             "--share joins them");
  add_certify_options(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  Wanted wanted = wanted_to_certify(args);
  const auto output = args.path("output");
  check_output(output, common.force || continues(args, output), {args.path("IN")});
  if (const auto share = share_option(args)) {
    refuse(args, {"picture-tolerance"}, "excludes --share: what pictures ask is known once all is measured");
    const auto journal = open_journal(args, common, share_path(output, *share));
    return resumable(*journal, [&] { return build_part(args, common, wanted, output, *share, *journal); });
  }
  Journals journals = open_journals(args, common, output, {output});
  journals.name_in(wanted.options.build);
  return resumable(*journals.own, [&] { return build_file(args, common, wanted, output, journals); });
}

}  // namespace vdvr::cli
