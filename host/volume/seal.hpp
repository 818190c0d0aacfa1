// The seal of a .vdvr file: one hash over its certificate, the totals by brick and every attribute
// (docs/file-format.md).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "host/files/hdf5/hdf5.hpp"

namespace vdvr {

/// The attribute of / that holds the seal, and is not part of it.
inline constexpr const char* kSeal = "seal";

/// 64 hexadecimal digits. `certificate` is the text as stored.
std::string seal_of(const std::string& certificate, std::span<const float> brick_totals,
                    std::vector<io::hdf5::Attribute> attributes);

}  // namespace vdvr
