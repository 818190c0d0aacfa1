// Kernel sources compiled into the library by cmake/EmbedKernels.cmake: name relative to kernels/ -> text.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace vdvr::opencl {

const std::map<std::string, std::string_view>& embedded_sources();
/// What every program is built with, its defines included.
std::string build_options(const std::vector<std::pair<std::string, std::string>>& defines);

}  // namespace vdvr::opencl
