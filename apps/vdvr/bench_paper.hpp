// vdvr bench paper. Called by bench.cpp.
#pragma once

#include "apps/vdvr/arguments.hpp"

namespace vdvr::cli {

int bench_paper(Arguments& args);

}  // namespace vdvr::cli
