// Small files that spare the next process some work, in $XDG_CACHE_HOME/vdvr or ~/.cache/vdvr. Whatever fails
// is as if there were no cache: whoever reads one checks what it holds.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace vdvr {

/// Empty where there is none: no such variable, or VDVR_CACHE=off.
std::filesystem::path cache_folder();

/// `name`: below the folder, as "devices/0f3a".
std::optional<std::string> read_cached(const std::string& name);
/// Whole or not at all, whoever else writes it.
void write_cached(const std::string& name, const std::string& bytes) noexcept;

}  // namespace vdvr
