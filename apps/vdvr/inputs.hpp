// What commands read: telling the kinds of files apart, loading them under the command's options, and
// comparing hashes.
#pragma once

#include <filesystem>
#include <optional>

#include "apps/vdvr/options.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/projections.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::cli {

enum class InputKind { certified, volume, scan };

/// Throws FileError when there is nothing, or an empty file.
InputKind kind_of(const std::filesystem::path& path, const Arguments& args);

/// A scan, checked for what reconstruction assumes; the notes of the check join the report's. `field.center`
/// overrides.
ProjectionSet load_scan(const std::filesystem::path& path, const Arguments& args, const FieldOptions& field,
                        const Progress& progress);

/// The centre that defines F: the field's, else the scan's.
double center_of(const FieldOptions& field, const ParallelGeometry& geometry);

/// Throws MismatchError when the certificate's own numbers do not follow from each other.
void check_consistency(const std::filesystem::path& path, const Certificate& certificate);
/// A certified volume. Throws MismatchError when it was altered or its certificate contradicts itself, and
/// says on stderr that a file is unsealed. `unverified`: neither.
VdvrFile read_certified(const std::filesystem::path& path, const Arguments& args, bool unverified = false);
/// Throws MismatchError when the projections are not those the volume was built from.
void check_input(const std::filesystem::path& path, const ProjectionSet& scan,
                 const Certificate& certificate);

/// The scan's geometry as `build` noted it in the certificate; none when another program wrote it without.
std::optional<ParallelGeometry> noted_geometry(const Certificate& certificate);

}  // namespace vdvr::cli
