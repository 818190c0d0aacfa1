#include "apps/vdvr/inputs.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/volume_file.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {

InputKind kind_of(const fs::path& path, const Arguments& args) {
  std::error_code error;
  if (!fs::exists(path, error)) throw FileError(fmt::format("{}: no such file or folder", path.string()));
  if (fs::is_directory(path, error)) return InputKind::scan;
  if (fs::is_regular_file(path, error) && fs::file_size(path, error) == 0)
    throw FileError(fmt::format("{}: is empty", path.string()));
  // A truncated .vdvr no longer looks like one: let its own reader say what is wrong.
  if (path.extension() == ".vdvr" || is_vdvr(path)) return InputKind::certified;
  if (is_volume_path(path) && !args.has("angles-file")) return InputKind::volume;
  return InputKind::scan;
}

ProjectionSet load_scan(const fs::path& path, const Arguments& args, const FieldOptions& field,
                        const Progress& progress) {
  switch (kind_of(path, args)) {
    case InputKind::certified:
      throw InputError(fmt::format("{}: is a certified volume, not projections", path.string()));
    case InputKind::volume:
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

void check_certificate(const fs::path& path, const VdvrFile& file) {
  const Certificate& c = file.certificate;
  const std::string found = content_sha256(file.volume);
  if (found != c.content_sha256)
    throw MismatchError(
        fmt::format("{}: the content has sha256 {}, but its certificate was issued for {}; build it again",
                    path.string(), found, c.content_sha256));
  const bool buffer_fits = c.total_buffer <= c.epsilon_abs;
  const bool image_fits =
      !c.total_image3d || !c.holds_image3d || *c.holds_image3d == (*c.total_image3d <= c.epsilon_abs);
  if (c.holds_buffer != buffer_fits || !image_fits)
    throw MismatchError(fmt::format(
        "{}: the certificate contradicts itself: 'holds' does not follow from total and epsilon_abs {}",
        path.string(), c.epsilon_abs));
}

void check_input(const fs::path& path, const ProjectionSet& scan, const Certificate& c) {
  if (scan.report.sha256 == c.input_sha256) return;
  throw MismatchError(fmt::format("{}: has sha256 {}, but the volume was built from {} with {}",
                                  path.string(), scan.report.sha256, c.input_name, c.input_sha256));
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
