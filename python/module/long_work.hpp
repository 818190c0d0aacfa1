// Work that takes long, called from Python: without the interpreter's lock, with progress, and ended by
// Ctrl-C.
#pragma once

#include <functional>
#include <mutex>

#include <nanobind/nanobind.h>

#include "vdvr/expert/progress.hpp"

namespace vdvr::python {

/// Does `work` in a thread of its own. Meanwhile the calling thread lets other threads of Python run, looks
/// for signals every 50 ms, and hands progress to `progress(stage, fraction)` unless that is None. What a
/// signal handler or `progress` raises ends the work and comes out here; so does what the work throws. The
/// wish to stop is the process's: other long work that goes on at that time ends with Interrupted.
void run_long(nanobind::handle progress, const std::function<void(const Progress&)>& work);

/// Held by whoever reads or writes HDF5 files, whose library takes one thread at a time. Not to be held with
/// the interpreter's lock by who waits for another's work.
std::mutex& hdf5_turn();

}  // namespace vdvr::python
