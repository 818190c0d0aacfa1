// vdvr build: the certified volume.
#include "vdvr/build.hpp"

#include <fmt/format.h>

#include "apps/vdvr/certify.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/progress.hpp"

namespace vdvr::cli {

int build_command(Arguments& args) {
  args.positional("IN", "projections").value("output,o", "OUT.vdvr", "the certified volume to write");
  add_plan_options(args);
  add_build(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  CertifyOptions options = certify_options(args);
  options.plan.foresee = false;
  const auto output = args.path("output");
  check_output(output, common.force, {args.path("IN")});

  Device device = open_device(common);
  ProgressLine progress(args.command(), common.quiet);
  const Planned planned = read_and_plan(device, args, options, progress.callback());
  const BuildResult result = build_certified(device, planned, options, progress.callback());
  throw_if_interrupted();
  write_vdvr(output, result.volume, result.certificate);
  progress.clear();

  const std::uint64_t bytes = std::filesystem::file_size(output);
  const Json json = {{"output", output.string()},
                     {"grid", grid_json(result.volume.grid)},
                     {"bricks", levels_json(result.volume)},
                     {"storage", storage_json(result.volume, bytes)},
                     {"certificate", certificate_json(result.certificate)},
                     {"seconds", seconds_json(result.seconds)}};
  print_result(common, json, [&] {
    print_scan(planned.scan);
    print_grid(result.volume.grid);
    print_certificate(result.certificate);
    print_storage(result.volume, bytes);
    print_seconds(result.seconds);
    fmt::print("written        {}\n", output.string());
  });
  return certificate_exit_code(args.command(), result.certificate);
}

}  // namespace vdvr::cli
