#include "apps/vdvr/inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/volume_file.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {

InputKind kind_of(const fs::path& path, const Arguments& args) {
  std::error_code error;
  const fs::path file = file_of_volume(path);
  if (!fs::exists(file, error)) throw FileError(fmt::format("{}: no such file or folder", file.string()));
  if (file != path) return InputKind::volume;
  if (fs::is_directory(path, error)) return is_volume_input(path) ? InputKind::volume : InputKind::scan;
  if (fs::is_regular_file(path, error) && fs::file_size(path, error) == 0)
    throw FileError(fmt::format("{}: is empty", path.string()));
  // A truncated .vdvr no longer looks like one: let its own reader say what is wrong.
  if (path.extension() == ".vdvr" || is_vdvr(path)) return InputKind::certified;
  if (is_volume_input(path) && !args.has("angles-file")) return InputKind::volume;
  return InputKind::scan;
}

ProjectionSet load_scan(const fs::path& path, const Arguments& args, const FieldOptions& field,
                        const Progress& progress) {
  switch (kind_of(path, args)) {
    case InputKind::certified:
      throw InputError(fmt::format("{}: is a certified volume, not projections", path.string()));
    case InputKind::volume:
      if (std::error_code error; fs::is_directory(path, error))
        throw InputError(fmt::format(
            "{}: holds TIFF slices and no scan.json, so it is a volume; a scan is described by scan.json",
            path.string()));
      throw InputError(
          fmt::format("{}: is a volume; give --angles-file if it is a stack of projections", path.string()));
    case InputKind::scan:
      break;
  }
  ScanOptions options;
  if (args.has("angles-file")) options.angles_file = args.path("angles-file");
  options.center = field.center;
  options.max_memory_bytes = common_options(args).max_memory;
  ProjectionSet scan = read_scan(path, options, progress);
  for (auto& note : check_scan(scan.geometry)) scan.report.notes.push_back(std::move(note));
  return scan;
}

double center_of(const FieldOptions& field, const ParallelGeometry& geometry) {
  return field.center.value_or(geometry.center);
}

void check_consistency(const fs::path& path, const Certificate& c) {
  if (const std::string what = contradiction(c); !what.empty())
    throw MismatchError(fmt::format("{}: the certificate contradicts itself: {}", path.string(), what));
}

VdvrFile read_certified(const fs::path& path, const Arguments& args, bool unverified) {
  const CommonOptions common = common_options(args);
  VdvrFile file = read_vdvr(path, common.max_memory, unverified ? Altered::report : Altered::refuse);
  if (unverified) return file;
  check_consistency(path, file.certificate);
  if (file.seal == Seal::none && !common.quiet)
    say(
        fmt::format("{}: {} is unsealed: of an earlier version, or edited since; `vdvr verify` compares "
                    "its certificate with the projections\n",
                    args.who(), path.string()));
  return file;
}

void check_input(const fs::path& path, const ProjectionSet& scan, const Certificate& c) {
  if (scan.report.sha256 == c.input_sha256) return;
  throw MismatchError(fmt::format(
      "{}: these are other projections: found {} of {} x {} x {} (views, rows, columns), sha256 {}; the "
      "volume "
      "was built from {} of {} with sha256 {}",
      path.string(), scan.report.name, scan.geometry.views(), scan.geometry.rows, scan.geometry.columns,
      scan.report.sha256, c.input_name, fmt::join(c.input_shape, " x "), c.input_sha256));
}

std::optional<ParallelGeometry> noted_geometry(const Certificate& certificate) {
  const auto options = nlohmann::json::parse(certificate.options_json, nullptr, false);
  if (!options.is_object() || !options.contains("geometry")) return std::nullopt;
  try {
    const auto& g = options.at("geometry");
    ParallelGeometry geometry;
    geometry.columns = g.at("columns").get<std::int64_t>();
    geometry.rows = g.at("rows").get<std::int64_t>();
    geometry.pitch_u = g.at("pitch_u").get<double>();
    geometry.pitch_v = g.at("pitch_v").get<double>();
    geometry.center = g.at("center").get<double>();
    geometry.unit = g.at("unit").get<std::string>();
    geometry.theta_rad = g.at("theta_rad").get<std::vector<double>>();
    return geometry;
  } catch (const nlohmann::json::exception& e) {
    throw FileError(fmt::format("certificate, options.geometry: {}", e.what()));
  }
}

}  // namespace vdvr::cli
