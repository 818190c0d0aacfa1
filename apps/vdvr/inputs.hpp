// What commands read: telling the kinds of files apart, loading them under the command's options, and
// comparing hashes.
#pragma once

#include <filesystem>

#include "apps/vdvr/options.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/expert/understood.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::cli {

enum class InputKind { certified, volume, scan };

/// Throws FileError when there is nothing, or an empty file.
InputKind kind_of(const std::filesystem::path& path, const Arguments& args);

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
                                  const Certificate& certificate, const Progress& progress);

/// A certified volume, by vdvr::read_certified; says on stderr that a file is unsealed. `unverified`: nothing
/// is compared.
VdvrFile open_certified(const std::filesystem::path& path, const Arguments& args, bool unverified = false);
/// vdvr::check_input, which names the path.
void check_projections(const std::filesystem::path& path, const ProjectionSet& scan,
                       const Certificate& certificate);

}  // namespace vdvr::cli
