// The library's errors in a program's words. Called by command.cpp and whoever prints what the library noted.
#pragma once

#include <string>

#include "vdvr/error.hpp"

namespace vdvr::cli {

/// The library names fields, `max_memory`; here they are options, --max-memory.
std::string with_options(const std::string& text);

/// 1 mismatch or tolerance out of reach; 2 bad usage or input; 3 device, memory or disk; interrupted: 128 and
/// the signal's number.
int exit_code_of(const Error& error);

}  // namespace vdvr::cli
