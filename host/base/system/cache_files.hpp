// Small files that spare the next process some work, in $XDG_CACHE_HOME/vdvr or ~/.cache/vdvr. Whatever fails
// is as if there were no cache: whoever reads one checks what it holds.
#pragma once

#include <cstdint>
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

/// Text whose last line says that the rest is what was written; none where it is not.
std::string sealed(const std::string& text);
std::optional<std::string> unsealed(const std::string& text);

/// Removes those of a folder's files that were written first, until the others take no more than that.
void forget_oldest(const std::string& folder, std::uintmax_t bytes) noexcept;

/// Whether someone may stand between this program and a device (LD_PRELOAD, LD_AUDIT, OPENCL_LAYERS), who
/// answers for it and does not say that it is not the device. What the device does is then not remembered.
bool behind_a_layer();

}  // namespace vdvr
