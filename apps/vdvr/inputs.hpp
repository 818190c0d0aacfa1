// What commands read: the options that say what inputs are, declared here and nowhere else; telling the kinds
// of files apart, loading them under these options, and comparing hashes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/vdvr/options.hpp"
#include "vdvr/expert/input_statement.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/noise.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/understood.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::cli {

// --- scans ---

/// --angles-file, --beam, --follow-links, and what a user states of the input: --entry, --views, --darks,
/// --flats, --transmission, --line-integrals.
void add_scan(Arguments& args);

/// What options state; what they do not is as `stored`, a certificate's.
InputStatement input_statement(const Arguments& args, const InputStatement& stored = {});

/// The cameras of --picture-tolerance: --picture-views, in earlier versions --views with a file.
bool has_picture_views(const Arguments& args);
std::string picture_views(const Arguments& args);

enum class InputKind { certified, volume, scan };

/// Throws FileError when there is nothing, or an empty file.
InputKind kind_of(const std::filesystem::path& path, const Arguments& args);
/// Throws InputError where it is no certified volume.
void require_certified(const std::filesystem::path& path, const Arguments& args);

/// A scan, checked for what reconstruction assumes; the notes of the check join the report's. `field.center`
/// overrides. `understood` is filled unless it is null.
ProjectionSet load_scan(const std::filesystem::path& path, const Arguments& args, const FieldOptions& field,
                        const Progress& progress, Understood* understood = nullptr);

/// How load_scan() reads.
ScanOptions scan_options(const Arguments& args, const FieldOptions& field);

/// The same without the check: of what reconstruction may refuse, too.
ProjectionSet load_any_scan(const std::filesystem::path& path, const Arguments& args,
                            const FieldOptions& field, const Progress& progress);

/// The checked scan under a certificate's field options, and with what was stated of its input. An HDF5 file
/// that the certificate says is of cone beam is read so (--beam). Throws MismatchError where options state
/// something else.
ProjectionSet load_certified_scan(const std::filesystem::path& path, const Arguments& args,
                                  const Certificate& certificate, const Progress& progress,
                                  Understood* understood = nullptr);
/// The same, whose longer rows are made by verify's own means (rows_to_verify.hpp).
ProjectionSet load_scan_to_verify(const std::filesystem::path& path, const Arguments& args,
                                  const Certificate& certificate, const Progress& progress);

// --- the noise of scans ---

/// --photons and --sigma-p: what is known of the noise in place of what the scan tells.
void add_noise(Arguments& args);
NoiseOptions noise_options(const Arguments& args);

struct NoiseFound {
  std::optional<ScanNoise> noise;
  std::string why;  ///< where there is none
};
/// Of the scan that was read from `path` with the same options.
NoiseFound noise_of_scan(const std::filesystem::path& path, const Arguments& args, const FieldOptions& field,
                         const ProjectionSet& scan);

// --- volumes ---

/// --nan-as, for commands that read uniform volumes.
void add_volume_input(Arguments& args);
/// read_volume, as the options say.
Volume load_volume(const std::filesystem::path& path, const Arguments& args);

/// A certified volume, by vdvr::read_certified; says on stderr that a file is unsealed. `unverified`: nothing
/// is compared.
VdvrFile open_certified(const std::filesystem::path& path, const Arguments& args, bool unverified = false);
/// vdvr::check_input, which names the path.
void check_projections(const std::filesystem::path& path, const ProjectionSet& scan,
                       const Certificate& certificate);

/// A certified volume with its certificate, or a uniform one without.
struct Scene {
  MixedVolume volume;
  std::optional<Certificate> certificate;
  bool verified = false;  ///< the content's hash was compared with the certificate's
};
/// `method`: "vdvr" the mixed volume, "dvr" its base samples alone (a uniform volume is the same either way).
/// Throws MismatchError for a content that does not match, unless `unverified`.
Scene open_scene(const std::filesystem::path& path, const Arguments& args, const std::string& method,
                 bool unverified);

}  // namespace vdvr::cli
