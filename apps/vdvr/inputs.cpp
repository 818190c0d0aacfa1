#include "apps/vdvr/inputs.hpp"

#include <fmt/format.h>

#include "apps/common/messages.hpp"
#include "apps/common/progress.hpp"
#include "apps/vdvr/crew.hpp"
#include "vdvr/certify.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_large.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/reconstruct.hpp"
#include "vdvr/verify_file.hpp"
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

namespace {

// Warnings go to the terminal whatever is printed there beside them.
void say_warnings(const Understood& understood, const Arguments& args) {
  for (const std::string& warning : understood.warnings)
    say(fmt::format("{}: WARNING: {}\n", args.who(), with_options(warning)));
}

void require_scan(const fs::path& path, const Arguments& args) {
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
}

ScanOptions scan_options(const Arguments& args, const FieldOptions& field, std::optional<Beam> beam,
                         const InputStatement& stored) {
  ScanOptions options;
  if (args.has("angles-file")) options.angles_file = args.path("angles-file");
  options.beam = args.has("beam") ? beam_of(args.choice("beam", "parallel")) : beam;
  options.center = field.center;
  options.preparation = field.preparation;
  options.input = input_statement(args, stored);
  options.follow_links = args.has("follow-links");
  const CommonOptions common = common_options(args);
  options.max_memory_bytes = common.max_memory;
  options.scratch = common.scratch;
  return options;
}

ProjectionSet load(const fs::path& path, const Arguments& args, const FieldOptions& field,
                   std::optional<Beam> beam, const InputStatement& stored, const Progress& progress,
                   Understood& understood) {
  require_scan(path, args);
  ProjectionSet scan = read_scan(path, scan_options(args, field, beam, stored), progress, &understood);
  if (!common_options(args).quiet) say_warnings(understood, args);
  return scan;
}

ProjectionSet checked(ProjectionSet scan) {
  for (auto& note : check_scan(scan)) scan.report.notes.push_back(std::move(note));
  return scan;
}

}  // namespace

ProjectionSet load_any_scan(const fs::path& path, const Arguments& args, const FieldOptions& field,
                            const Progress& progress) {
  Understood understood;
  return load(path, args, field, {}, {}, progress, understood);
}

ProjectionSet load_scan(const fs::path& path, const Arguments& args, const FieldOptions& field,
                        const Progress& progress, Understood* understood) {
  Understood own;
  return checked(load(path, args, field, {}, {}, progress, understood ? *understood : own));
}

ScanOptions scan_options(const Arguments& args, const FieldOptions& field) {
  return scan_options(args, field, {}, {});
}

ProjectionSet load_certified_scan(const fs::path& path, const Arguments& args, const Certificate& certificate,
                                  const Progress& progress) {
  const auto geometry = noted_geometry(certificate);
  const InputStatement stored = noted_input(certificate);
  std::error_code error;
  // Folders say it themselves; no other file is of cone beam.
  const bool bare = fs::is_regular_file(path, error) && path.filename() != "scan.json";
  Understood understood;
  ProjectionSet scan =
      checked(load(path, args, certificate.field,
                   geometry && geometry->cone && bare ? std::optional(Beam::cone) : std::nullopt, stored,
                   progress, understood));
  if (understood.stated != stored)
    throw MismatchError(fmt::format("{}: options state of the input: {}; the volume was built with: {}",
                                    path.string(), text_of(understood.stated), text_of(stored)));
  return scan;
}

VdvrFile open_certified(const fs::path& path, const Arguments& args, bool unverified) {
  const CommonOptions common = common_options(args);
  const std::uint64_t memory = common.max_memory / static_cast<std::uint64_t>(processes_here());
  if (unverified) return read_large_vdvr(path, memory, common.scratch, Altered::report);
  VdvrFile file = read_large_certified(path, memory, common.scratch);
  if (file.seal == Seal::none && !common.quiet)
    say(
        fmt::format("{}: {} is unsealed: of an earlier version, or edited since; `vdvr verify` compares "
                    "its certificate with the projections\n",
                    args.who(), path.string()));
  return file;
}

void check_projections(const fs::path& path, const ProjectionSet& scan, const Certificate& certificate) {
  try {
    check_input(scan, certificate);
  } catch (MismatchError& e) {
    e.add_context(path.string());
    throw;
  }
}

}  // namespace vdvr::cli
