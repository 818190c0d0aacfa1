// vdvr reconstruct: uniform filtered back-projection.
#include "vdvr/expert/reconstruct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <span>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/volume_output.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {

int reconstruct_command(Arguments& args) {
  args.positional("IN", "projections")
      .value("output,o", "VOL",
             "what to write: .mha .nrrd .tif .h5 .npy .raw .zarr, or a folder of TIFF slices");
  add_scan(args);
  add_field(args);
  add_grid(args);
  add_rates(args);
  add_volume_output(args, "mha|nrrd|tiff|hdf5|npy|raw|ome-zarr",
                    "what integers span, and needed for them; values outside become the nearest");
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const RateOptions rates = rate_options(args);
  const GridOptions grid_wanted = grid_options(args);
  refuse(args, {"roi"}, "a uniform volume has no bricks to leave out; use --size and --origin");
  if (rates.gold)
    throw InputError("--gold: a uniform volume has no gold standard; use --spacing for a finer grid");
  ReconstructOptions options;
  options.field = field_options(args);
  options.upsampling = rates.upsampling.value_or(options.upsampling);
  options.interpolation = rates.interpolation.value_or(options.interpolation);
  const auto output = args.path("output");
  const ExportFormat format = output_format(args, output);
  const ExportOptions writes = volume_output_options(args, common, format);
  check_uniform_output(output, writes);
  check_volume_output(output, format, common.force, {args.path("IN")});

  Device device = open_device(common);
  ProgressLine progress(args.who(), common.quiet);
  const ProjectionSet scan = load_scan(args.path("IN"), args, options.field, progress.callback());
  const Grid grid = make_grid(scan, grid_wanted);
  UniformWriter file(output, grid, writes);
  float lo = std::numeric_limits<float>::infinity(), hi = -lo;
  const auto take = [&](std::int64_t, std::span<const float> planes) {
    throw_if_stopped();
    const auto [low, high] = std::minmax_element(planes.begin(), planes.end());
    lo = std::min(lo, *low);
    hi = std::max(hi, *high);
    file.append(planes);
  };
  reconstruct_planes(device, scan, grid, options, take, progress.callback());
  const ExportResult written = file.commit();
  progress.clear();

  Json json = {{"output", output.string()},
               {"format", text_of(format)},
               {"bytes", written.bytes},
               {"geometry", geometry_json(scan.geometry)},
               {"report", report_json(scan.report)},
               {"grid", grid_json(grid)},
               {"upsampling", options.upsampling},
               {"u_filter", text_of(options.interpolation)},
               {"filter", text_of(options.field.filter)},
               {"range", {lo, hi}},
               {"device", device.info().name},
               {"seconds", seconds_json(progress.seconds())}};
  const bool integers = writes.samples != SampleType::f32;
  if (integers) {
    json["scale"] = written.scale;
    json["offset"] = written.offset;
    json["clipped"] = written.clipped;
  }
  print_result(common, json, [&] {
    print_scan(scan);
    print_grid(grid);
    fmt::print("reconstructed  u {}x {}, filter {}: {:.6g} to {:.6g}\n", options.upsampling,
               text_of(options.interpolation), text_of(options.field.filter), lo, hi);
    print_seconds(progress.seconds());
    if (integers)
      fmt::print("integers       value = {} + {} * integer; {} samples lay outside\n", written.offset,
                 written.scale, written.clipped);
    fmt::print("written        {} ({})\n", output.string(), bytes_text(written.bytes));
  });
  return 0;
}

}  // namespace vdvr::cli
