// The report's section on storage: bytes against those of a uniform grid, and the levels. Called by
// report.cpp.
#pragma once

#include "apps/vdvr/report.hpp"

namespace vdvr::cli {

std::string storage_section(const RunReport& run);

}  // namespace vdvr::cli
