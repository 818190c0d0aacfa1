// The order of numbered files. Called by scan_folder.cpp and volume_stack.cpp.
#pragma once

#include <string>

namespace vdvr::io {

/// a2 before a10.
bool natural_less(const std::string& a, const std::string& b);

}  // namespace vdvr::io
