// For caches of OpenCL objects that lie outside a State: they must let go when their device ends. Left to the
// destructors of statics, they would go after the thread-local objects of the OpenCL implementation, which
// some still need then.
#pragma once

#include "host/base/opencl/state.hpp"

namespace vdvr::opencl {

/// `forget` is called with the state of every device that ends from now on, before the state goes. It must
/// not throw. Up to 4; a further one throws std::logic_error.
void before_device_ends(void (*forget)(const State&) noexcept);

}  // namespace vdvr::opencl
