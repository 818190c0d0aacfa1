#include "apps/vdvr/volume_output.hpp"

#include <fmt/format.h>

#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {

void add_volume_output(Arguments& args, const std::string& formats, const std::string& range_help) {
  args.value("format", formats, "default: by the ending of the name; a folder is a stack of TIFF slices")
      .value(
          "samples", "f32|u16|u8",
          "type in tiff, hdf5, npy and raw (default f32); integers stand for offset + scale * integer, which "
          "is recorded")
      .value("range", "LO,HI", range_help)
      .value("compression", "none|deflate", "of formats that have one (default deflate)");
}

ExportFormat output_format(const Arguments& args, const fs::path& output) {
  const auto by_name = export_format_of(output);
  std::error_code ignored;
  if (!args.has("format")) {
    if (by_name) return *by_name;
    if (!output.has_filename() || fs::is_directory(output, ignored)) return ExportFormat::tiff;
    throw InputError(fmt::format(
        "{}: end the name in .mha, .nrrd, .tif, .h5, .npy, .raw or .zarr, or in / for a folder of TIFF "
        "slices, or say --format",
        output.string()));
  }
  const std::string text = args.choice("format", "mha");
  for (const ExportFormat f :
       {ExportFormat::mha, ExportFormat::nrrd, ExportFormat::tiff, ExportFormat::hdf5, ExportFormat::npy,
        ExportFormat::raw, ExportFormat::ome_zarr, ExportFormat::vtm})
    if (text == text_of(f)) {
      // Their readers, and VTK's, go by the name.
      const bool by_its_name = f == ExportFormat::mha || f == ExportFormat::nrrd || f == ExportFormat::vtm;
      if (by_name != f && (by_its_name || by_name))
        throw InputError(
            fmt::format("{}: --format {} needs another ending of the name", output.string(), text));
      return f;
    }
  throw InputError("--format: unknown");
}

ExportOptions volume_output_options(const Arguments& args, const CommonOptions& common, ExportFormat format) {
  const bool packs =
      format == ExportFormat::vtm || format == ExportFormat::hdf5 || format == ExportFormat::ome_zarr;
  if (args.has("compression") && !packs)
    throw InputError(fmt::format("--compression is for hdf5, ome-zarr and vtm, not for {}", text_of(format)));
  ExportOptions o;
  o.format = format;
  const std::string samples = args.choice("samples", "f32");
  o.samples = samples == "u8" ? SampleType::u8 : samples == "u16" ? SampleType::u16 : SampleType::f32;
  if (const auto range = args.numbers("range", 2)) o.range = {(*range)[0], (*range)[1]};
  if (args.choice("compression", "deflate") == "none") o.compression = Compression::none;
  o.max_memory_bytes = common.max_memory;
  return o;
}

void check_volume_output(const fs::path& output, ExportFormat format, bool force,
                         const std::vector<fs::path>& inputs) {
  std::error_code ignored;
  for (const fs::path& path : export_outputs(output, format)) {
    if (!fs::is_directory(path, ignored)) {
      check_output(path, force, inputs);
    } else if (format != ExportFormat::tiff && format != ExportFormat::ome_zarr &&
               (format != ExportFormat::vtm || path == output)) {
      throw InputError(fmt::format("{}: is a folder, not a file to write", path.string()));
    } else if (!fs::is_empty(path, ignored) && !force) {
      throw InputError(fmt::format("{}: exists already; --force overwrites it", path.string()));
    }
  }
}

}  // namespace vdvr::cli
