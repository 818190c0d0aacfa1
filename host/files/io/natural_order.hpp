// The order of numbered files.
#pragma once

#include <string>

namespace vdvr::io {

/// a2 before a10.
bool natural_less(const std::string& a, const std::string& b);

}  // namespace vdvr::io
