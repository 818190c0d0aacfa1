#include "apps/vdvr/inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

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

std::string altered_content(const VdvrFile& file) {
  const std::string found = content_sha256(file.volume);
  if (found == file.certificate.content_sha256) return {};
  return fmt::format(
      "the content does not match its hash: it has sha256 {}, but its certificate was issued for {}", found,
      file.certificate.content_sha256);
}

void check_consistency(const fs::path& path, const Certificate& c) {
  const auto contradicts = [&](const std::string& what) {
    throw MismatchError(fmt::format("{}: the certificate contradicts itself: {}", path.string(), what));
  };
  if (c.comparison) {
    if (c.holds_buffer || c.holds_image3d.value_or(false))
      contradicts("it was built for comparison, and yet something 'holds'");
    return;
  }
  const bool buffer_fits = c.total_buffer <= c.epsilon_abs;
  const bool image_fits =
      !c.total_image3d || !c.holds_image3d || *c.holds_image3d == (*c.total_image3d <= c.epsilon_abs);
  if (c.holds_buffer != buffer_fits || !image_fits)
    contradicts(fmt::format("'holds' does not follow from total and epsilon_abs {}", c.epsilon_abs));
  // Written with all digits: what differs in the tenth was not written together.
  const auto same = [](double a, double b) {
    return std::abs(a - b) <= 1e-10 * std::max(std::abs(a), std::abs(b));
  };
  if (c.reference_range > 0 && !same(c.epsilon * c.reference_range, c.epsilon_abs))
    contradicts(fmt::format("epsilon_abs {} is not epsilon {} of the reference range {}", c.epsilon_abs,
                            c.epsilon, c.reference_range));
  const double sum = c.measured_total + c.budget.arithmetic.value;
  if (!same(c.total_buffer, sum + c.budget.sampler.buffer.value))
    contradicts(fmt::format("total {} of the buffer sampler is not measured_total, arithmetic and sampler",
                            c.total_buffer));
  if (c.total_image3d && c.budget.sampler.image3d &&
      !same(*c.total_image3d, sum + c.budget.sampler.image3d->value))
    contradicts(fmt::format("total {} of the image3d sampler is not measured_total, arithmetic and sampler",
                            *c.total_image3d));
}

void check_certificate(const fs::path& path, const VdvrFile& file) {
  if (const std::string altered = altered_content(file); !altered.empty())
    throw MismatchError(fmt::format("{}: {}; build it again", path.string(), altered));
  check_consistency(path, file.certificate);
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
