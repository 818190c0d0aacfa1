// vdvr bench tune. Called by bench.cpp.
#pragma once

#include "apps/common/arguments.hpp"

namespace vdvr::cli {

int bench_tune(Arguments& args);

}  // namespace vdvr::cli
