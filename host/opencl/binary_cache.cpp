#include "host/opencl/binary_cache.hpp"

#include <cstdlib>
#include <string_view>
#include <vector>

#include "host/system/cache_files.hpp"
#include "vdvr/hash.hpp"

namespace vdvr::opencl {
namespace {

// Some hundred programs; a picture needs one, a build some twenty.
constexpr std::uint64_t most_bytes = 256u << 20;
constexpr std::size_t hash_length = 64;

bool is_used(const State& state) {
  const char* wanted = std::getenv("VDVR_KERNEL_CACHE");
  if (wanted != nullptr && std::string_view(wanted) == "on") return true;
  if (wanted != nullptr && std::string_view(wanted) == "off") return false;
  // PoCL keeps what it compiled, with more than a binary holds (docs/robustness.md).
  return state.info.platform != "Portable Computing Language";
}

std::string name_of(const State& state, const std::string& source, const std::string& options) {
  const DeviceInfo& d = state.info;
  std::string text = VDVR_VERSION;
  for (const std::string& part : {d.platform, d.name, d.vendor, d.version, d.driver, options, source})
    text += '\n' + part;
  return "kernels/" + sha256_of_text(text);
}

}  // namespace

std::optional<cl::Program> kept_program(const State& state, const std::string& source,
                                        const std::string& options) {
  if (!is_used(state)) return std::nullopt;
  const std::optional<std::string> kept = read_cached(name_of(state, source, options));
  // The binary's hash, then the binary: drivers need not survive a damaged one.
  if (!kept || kept->size() <= hash_length) return std::nullopt;
  const std::string binary = kept->substr(hash_length);
  if (sha256_of_text(binary) != kept->substr(0, hash_length)) return std::nullopt;
  try {
    cl::Program program(state.context, {state.device}, cl::Program::Binaries{{binary.begin(), binary.end()}});
    program.build({state.device}, options.c_str());
    return program;
  } catch (const cl::Error&) {
    return std::nullopt;
  }
}

void keep_program(const State& state, const std::string& source, const std::string& options,
                  const cl::Program& built) noexcept {
  try {
    if (!is_used(state)) return;
    const std::vector<std::vector<unsigned char>> binaries = built.getInfo<CL_PROGRAM_BINARIES>();
    if (binaries.size() != 1 || binaries[0].empty()) return;
    const std::string binary(binaries[0].begin(), binaries[0].end());
    write_cached(name_of(state, source, options), sha256_of_text(binary) + binary);
    shrink_cache("kernels", most_bytes);
  } catch (...) {  // the next process compiles it again
  }
}

}  // namespace vdvr::opencl
