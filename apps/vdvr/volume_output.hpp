// Options of what uniform volumes are written as, and what may stand in their way: shared by the commands
// that write volumes for other programs.
#pragma once

#include <filesystem>
#include <vector>

#include "apps/common/arguments.hpp"
#include "apps/vdvr/options.hpp"
#include "vdvr/export_volume.hpp"

namespace vdvr::cli {

/// --format, --samples, --range, --compression. `formats` as they stand in --help.
void add_volume_output(Arguments& args, const std::string& formats, const std::string& range_help);

/// By --format, or else the ending of the name, a folder being a stack of TIFF slices. Throws InputError.
ExportFormat output_format(const Arguments& args, const std::filesystem::path& output);
/// The options of add_volume_output; those that mean nothing to the format are refused by name.
ExportOptions volume_output_options(const Arguments& args, const CommonOptions& common, ExportFormat format);

/// As check_output, where an output may be a folder too.
void check_volume_output(const std::filesystem::path& output, ExportFormat format, bool force,
                         const std::vector<std::filesystem::path>& inputs);

}  // namespace vdvr::cli
