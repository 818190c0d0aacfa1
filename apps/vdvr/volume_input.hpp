// Uniform volumes as commands read them.
#pragma once

#include <filesystem>

#include "apps/common/arguments.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr::cli {

/// --nan-as, for commands that read uniform volumes.
void add_volume_input(Arguments& args);
/// read_volume, as the options say.
Volume load_volume(const std::filesystem::path& path, const Arguments& args);

}  // namespace vdvr::cli
