// Kernel sources compiled into the library by cmake/EmbedKernels.cmake: name relative to kernels/ -> text.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace vdvr::opencl {

const std::map<std::string, std::string_view>& embedded_sources();

}  // namespace vdvr::opencl
