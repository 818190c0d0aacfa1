// The wish that long work ends. Loops over host threads and launches of kernels look for it, whether or not
// they report progress; the library installs no signal handler, a program's handler calls request_stop.
#pragma once

#include "vdvr/api.hpp"

namespace vdvr {

/// All long work of this process throws Interrupted(reason) at its next look; `reason` is any number of the
/// caller's but 0, which takes the wish back. May be called from signal handlers and from any thread.
VDVR_API void request_stop(int reason) noexcept;

/// The reason given, or 0.
VDVR_API int stop_requested() noexcept;

/// Throws Interrupted if a stop was requested.
VDVR_API void throw_if_stopped();

}  // namespace vdvr
