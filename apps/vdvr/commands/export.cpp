// vdvr export: a certified volume as files of other programs: uniform ones, and VTK's boxes of bricks.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/volume_output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/export_volume.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {
namespace {

constexpr const char* default_blocks = "2000";

/// Options that mean nothing to the format are refused by name.
void refuse_unused(const Arguments& args, ExportFormat format) {
  const auto only = [&](const char* option, bool used, const char* of) {
    if (args.has(option) && !used)
      throw InputError(fmt::format("--{} is for {}, not for {}", option, of, text_of(format)));
  };
  const bool vtm = format == ExportFormat::vtm;
  only("oversampling", !vtm, "uniform samples");
  only("blocks", vtm, "vtm");
  only("sigma", !vtm, "uniform samples");
}

ExportOptions options_of(const Arguments& args, const CommonOptions& common, ExportFormat format) {
  ExportOptions o = volume_output_options(args, common, format);
  const char* fallback = format == ExportFormat::ome_zarr ? "4" : "1";
  o.oversampling = std::stoi(args.choice("oversampling", fallback));
  o.most_blocks =
      static_cast<std::size_t>(args.integer_or("blocks", std::stoi(default_blocks), 1, 10'000'000));
  return o;
}

Json result_json(const fs::path& output, const ExportOptions& o, const ExportResult& r) {
  Json j = {{"output", output.string()}, {"format", text_of(o.format)}};
  if (o.format == ExportFormat::vtm) j["blocks"] = r.blocks;
  else j["oversampling"] = o.oversampling;
  j["grid"] = grid_json(r.grid);
  j["samples"] = r.samples;
  j["bytes"] = r.bytes;
  j["exact_between_samples"] = r.exact_between_samples;
  if (r.exact_between_samples) j["jump"] = r.jump;
  if (o.samples != SampleType::f32) {
    j["scale"] = r.scale;
    j["offset"] = r.offset;
    j["clipped"] = r.clipped;
  }
  return j;
}

void print_export(const fs::path& output, const ExportOptions& o, const ExportResult& r,
                  const VdvrFile& file) {
  print_grid(r.grid);
  if (o.format == ExportFormat::vtm)
    fmt::print("blocks         {} of {} points together\n", r.blocks, r.samples);
  if (o.samples != SampleType::f32)
    fmt::print("integers       value = {} + {} * integer; {} samples lay outside\n", r.offset, r.scale,
               r.clipped);
  const double epsilon = file.certificate.epsilon_abs;
  if (file.certificate.comparison) fmt::print("certified      no: the volume is a comparison\n");
  else if (o.samples != SampleType::f32)
    fmt::print(
        "certified      |value - F| <= {:.4g} at covered samples{}: epsilon and half an integer's step\n",
        epsilon + r.scale / 2, r.clipped > 0 ? " that did not lie outside" : "");
  else if (r.exact_between_samples)
    fmt::print("certified      |value - F| <= {:.4g} at covered samples, {:.4g} between them (trilinear)\n",
               epsilon, epsilon + r.jump);
  else
    fmt::print("certified      |value - F| <= {:.4g} at covered samples; between them they are too coarse\n",
               epsilon);
  fmt::print("written        {} ({})\n", output.string(), bytes_text(r.bytes));
}

}  // namespace

int export_command(Arguments& args) {
  args.positional("FILE", "the certified volume")
      .value("output,o", "VOL",
             "what to write: .mha .nrrd .tif .h5 .npy .raw .zarr .vtm, or a folder of TIFF slices")
      .value("oversampling", "1|2|4|8",
             "samples per cell of the grid and axis (default 1; of ome-zarr 4, the finest of its levels)")
      .value("blocks", "N",
             std::string("vtm: at most about so many .vti files (default ") + default_blocks +
                 "); fewer hold more points")
      .flag(
          "sigma",
          "also NAME-sigma beside it, of the same samples: what the scan's own noise leaves in F (estimated)")
      .flag("unverified", "export although content and certificate do not match");
  add_volume_output(
      args, "mha|nrrd|tiff|hdf5|npy|raw|ome-zarr|vtm",
      "what integers span (default: the range of the values); values outside become the nearest");
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const auto path = args.path("FILE"), output = args.path("output");
  const ExportFormat format = output_format(args, output);
  refuse_unused(args, format);
  const ExportOptions options = options_of(args, common, format);
  check_volume_output(output, format, common.force, {path});
  if (args.has("sigma")) check_volume_output(sigma_path(output), format, common.force, {path});
  require_certified(path, args);

  ProgressLine progress(args.who(), common.quiet);
  const VdvrFile file = open_certified(path, args, args.has("unverified"));
  if (args.has("sigma") && file.certificate.brick_sigma.empty())
    throw InputError(fmt::format(
        "{}: --sigma: the certificate does not know the scan's noise; build it with --photons or --sigma-p",
        path.string()));
  const ExportResult result = export_volume(file, output, options, progress.callback());
  Json json = result_json(output, options, result);
  if (args.has("sigma")) {
    export_sigma(file, sigma_path(output), result.grid, options, progress.callback());
    json["sigma"] = sigma_path(output).string();
  }
  progress.clear();
  print_result(common, json, [&] {
    print_export(output, options, result, file);
    if (args.has("sigma")) fmt::print("sigma          {}\n", sigma_path(output).string());
  });
  return 0;
}

}  // namespace vdvr::cli
