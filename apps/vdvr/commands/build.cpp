// vdvr build: the certified volume.
#include "vdvr/build.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/common/progress.hpp"
#include "apps/vdvr/certify.hpp"
#include "apps/vdvr/output.hpp"

namespace vdvr::cli {

namespace {

int build_file(const Arguments& args, const CommonOptions& common, const Wanted& wanted,
               const std::filesystem::path& output) {
  Device device = open_device(common);
  ProgressLine progress(args.who(), common.quiet);
  Planned planned = read_and_plan(device, args, wanted, progress.callback());
  const BuildResult result = build_planned(device, planned, wanted, progress.callback());
  throw_if_stopped();
  write_vdvr(output, result.volume, result.certificate, wanted.compression);
  wanted.options.build.journal->remove();
  progress.clear();

  const std::uint64_t bytes = std::filesystem::file_size(output);
  const Json json = {{"output", output.string()},
                     {"grid", grid_json(result.volume.grid)},
                     {"bricks", levels_json(result.volume)},
                     {"storage", storage_json(result.volume, bytes)},
                     {"resumed", {{"records", wanted.options.build.journal->replayed()}}},
                     {"peak_bytes", device.peak_memory()},
                     {"pictures", pictures_json(planned)},
                     {record_name(result.certificate), certificate_json(result.certificate)},
                     {"seconds", seconds_json(result.seconds)}};
  print_result(common, json, [&] {
    print_scan(planned.scan);
    print_grid(result.volume.grid);
    print_certificate(result.certificate);
    print_pictures(planned);
    print_storage(result.volume, bytes);
    print_seconds(result.seconds);
    fmt::print("written        {}\n", output.string());
  });
  return std::max(pictures_exit_code(args.who(), planned),
                  certificate_exit_code(args.who(), result.certificate));
}

}  // namespace

int build_command(Arguments& args) {
  args.positional("IN", "projections").value("output,o", "OUT.vdvr", "the certified volume to write");
  add_certify_options(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  Wanted wanted = wanted_to_certify(args);
  const auto output = args.path("output");
  check_output(output, common.force || continues(args, output), {args.path("IN")});
  const auto journal = open_journal(args, common, output, {output});
  wanted.options.build.journal = journal.get();
  return resumable(*journal, [&] { return build_file(args, common, wanted, output); });
}

}  // namespace vdvr::cli
