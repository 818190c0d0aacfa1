// Builds embedded kernel programs, once per set of defines. And the names of OpenCL's codes, for error
// messages.
//
// Flags: -cl-std=CL1.2, and no relaxed arithmetic: what a certificate covers must round as the bound assumes.
// For the same reason no product is joined with a sum unless a kernel says fma. Warnings are errors in tests,
// which set VDVR_KERNEL_WARNINGS=error: one hid an uninitialised pointer that made certificates too good. In
// the field a compiler that we never saw may warn of what is right.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <set>
#include <sstream>
#include <vector>

#include "host/base/opencl/embedded.hpp"
#include "host/base/opencl/state.hpp"
#include "host/base/opencl/trust.hpp"
#include "host/base/system/cache_files.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::opencl {
namespace {

void append_resolved(const std::string& name, std::set<std::string>& seen, std::string& out) {
  const auto& sources = embedded_sources();
  const auto found = sources.find(name);
  if (found == sources.end()) throw BuildError(fmt::format("kernel source '{}' is not embedded", name));
  if (!seen.insert(name).second) return;
  out += fmt::format("#line 1 \"kernels/{}\"\n", name);
  std::istringstream lines{std::string(found->second)};
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string key = "#include \"";
    if (line.rfind(key, 0) == 0) {
      append_resolved(line.substr(key.size(), line.find('"', key.size()) - key.size()), seen, out);
      out += fmt::format("#line {} \"kernels/{}\"\n", number + 1, name);
    } else {
      out += line + '\n';
    }
  }
}

}  // namespace

std::string resolve_source(const std::string& name) {
  std::set<std::string> seen;
  // How functions take vectors wider than the CPU's is the compiler's own affair, since all callers are its
  // own: PoCL without AVX-512 warns of it.
  std::string out =
      "#pragma OPENCL FP_CONTRACT OFF\n#ifdef __has_warning\n#if __has_warning(\"-Wpsabi\")\n"
      "#pragma clang diagnostic ignored \"-Wpsabi\"\n#endif\n#endif\n";
  append_resolved(name, seen, out);
  return out;
}

std::string build_options(const Defines& defines) {
  const char* warnings = std::getenv("VDVR_KERNEL_WARNINGS");
  const bool errors = warnings != nullptr && std::string_view(warnings) == "error";
  std::string options = fmt::format("-cl-std=CL1.2{} -DVDVR_DIALECT_OPENCL", errors ? " -Werror" : "");
  for (const auto& [key, value] : defines) options += fmt::format(" -D{}={}", key, value);
  return options;
}

std::size_t State::programs_remembered() {
  const std::lock_guard guard(programs_lock_);
  return programs_remembered_;
}

namespace {

constexpr const char* kept_programs = "programs";
constexpr std::uintmax_t most_kept = 64 << 20;

// All that a binary depends on; none where it is not to be kept. PoCL reads a program with all of the
// language's functions before it looks into its own cache: 20 to 60 ms each, of which a command asks for 20
// or more. Intel's runtime for CPUs has none. Drivers of GPUs have their own.
std::string binary_head(const State& state, const std::string& source, const std::string& options) {
  const bool pays =
      state.info.platform == pocl_platform || (state.info.is_cpu && state.info.platform.starts_with("Intel"));
  if (!pays || behind_a_layer()) return {};
  const char* flags = std::getenv("POCL_EXTRA_BUILD_FLAGS");
  return "vdvr: a program of kernels\n" + identity(state) + sha256_of_text(source) + '\n' + options + '\n' +
         (flags != nullptr ? flags : "") + '\n';
}

std::string file_of(const std::string& head) {
  return fmt::format("{}/{}", kept_programs, sha256_of_text(head));
}

// As an earlier process had it built.
std::optional<cl::Program> remembered(const State& state, const std::string& head,
                                      const std::string& options) {
  if (head.empty()) return std::nullopt;
  const auto file = read_cached(file_of(head));
  const auto inside = file ? unsealed(*file) : std::nullopt;
  if (!inside || !inside->starts_with(head)) return std::nullopt;
  try {
    const std::vector<unsigned char> binary(inside->begin() + static_cast<std::ptrdiff_t>(head.size()),
                                            inside->end());
    cl::Program program(state.context, {state.device}, {binary});
    program.build({state.device}, options.c_str());
    return program;
  } catch (const cl::Error&) {  // not what this driver takes any more: it is built anew
    return std::nullopt;
  }
}

// To hand a binary out PoCL compiles every kernel of the program once more, for groups of any size: that
// takes some twenty times what the binary spares a process. So it is asked for the binary of a program that
// as many processes have built already, and a process spends a second on binaries, and what the last one
// takes beyond.
constexpr int processes_before = 8;
constexpr std::chrono::seconds most_spent{1};

// A letter in a file for each process that built the program, this one included.
bool is_built_often(const std::string& head) {
  const std::string name = file_of(head) + ".built", before = read_cached(name).value_or("");
  if (before.size() >= processes_before) return true;
  write_cached(name, before + "x");
  return false;
}

void remember(const State& state, const cl::Program& program, const std::string& head) {
  if (head.empty()) return;
  static std::atomic<std::chrono::steady_clock::duration> spent{};
  const char* cache = std::getenv("VDVR_CACHE");
  const bool at_once =
      state.info.platform != pocl_platform || (cache != nullptr && std::string_view(cache) == "programs");
  if (!at_once && (!is_built_often(head) || spent.load() > most_spent)) return;
  const auto start = std::chrono::steady_clock::now();
  try {
    const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
    if (binaries.size() == 1 && !binaries[0].empty()) {
      write_cached(file_of(head), sealed(head + std::string(binaries[0].begin(), binaries[0].end())));
      forget_oldest(kept_programs, most_kept);
    }
  } catch (const cl::Error&) {  // no binary to be had
  }
  if (!at_once) spent = spent.load() + (std::chrono::steady_clock::now() - start);
}

}  // namespace

const cl::Program& State::built(const std::string& name, const Defines& defines) {
  const std::string options = build_options(defines), key = name + ' ' + options;
  const auto known = [&]() -> const cl::Program* {
    const std::lock_guard guard(programs_lock_);
    const auto found = programs_.find(key);
    return found == programs_.end() ? nullptr : &found->second;
  };
  if (const cl::Program* const there = known()) return *there;
  const std::lock_guard building(building_lock_);
  if (const cl::Program* const there = known()) return *there;
  const std::string source = resolve_source(name + ".cl"), head = binary_head(*this, source, options);
  if (auto found = remembered(*this, head, options)) {
    const std::lock_guard guard(programs_lock_);
    ++programs_remembered_;
    return programs_.emplace(key, *std::move(found)).first->second;
  }
  cl::Program program;
  try {
    program = cl::Program(context, source);
    program.build({device}, options.c_str());
  } catch (const cl::Error& e) {
    // LLVM's own handler removes the files of a compilation that a signal interrupts, which then fails.
    throw_if_stopped();
    std::string log;
    try {
      log = program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device);
    } catch (const cl::Error&) {
      log = "(no log)";
    }
    throw BuildError(fmt::format("kernel program '{}' does not build on '{}' with options '{}': {} {}\n{}",
                                 name, info.name, options, e.what(), code_name(e.err()), log));
  }
  remember(*this, program, head);
  const std::lock_guard guard(programs_lock_);
  return programs_.emplace(key, std::move(program)).first->second;
}

const cl::Program& program(State& of_strand, const std::string& name, const Defines& defines) {
  State& state = of_strand.main_;
  const cl::Program& built = state.built(name, defines);
  const std::lock_guard guard(state.programs_lock_);
  if (state.told_.insert(&built).second && state.on_program) state.on_program(name, defines);
  return built;
}

std::optional<ReadyKernel> KernelPool::take(const std::string& key) {
  const std::lock_guard guard(lock_);
  const auto found = idle_.find(key);
  if (found == idle_.end() || found->second.empty()) return std::nullopt;
  ReadyKernel out = std::move(found->second.back());
  found->second.pop_back();
  return out;
}

void KernelPool::keep(const std::string& key, ReadyKernel kernel) noexcept {
  try {
    const std::lock_guard guard(lock_);
    idle_[key].push_back(std::move(kernel));
  } catch (...) {  // no memory for its entry: the next launcher makes one
  }
}

std::string code_name(int code) {
#define VDVR_CODE(name) \
  case name:            \
    return #name " (" + std::to_string(code) + ")"
  switch (code) {
    VDVR_CODE(CL_SUCCESS);
    VDVR_CODE(CL_DEVICE_NOT_FOUND);
    VDVR_CODE(CL_DEVICE_NOT_AVAILABLE);
    VDVR_CODE(CL_COMPILER_NOT_AVAILABLE);
    VDVR_CODE(CL_MEM_OBJECT_ALLOCATION_FAILURE);
    VDVR_CODE(CL_OUT_OF_RESOURCES);
    VDVR_CODE(CL_OUT_OF_HOST_MEMORY);
    VDVR_CODE(CL_IMAGE_FORMAT_NOT_SUPPORTED);
    VDVR_CODE(CL_BUILD_PROGRAM_FAILURE);
    VDVR_CODE(CL_MAP_FAILURE);
    VDVR_CODE(CL_INVALID_VALUE);
    VDVR_CODE(CL_INVALID_DEVICE);
    VDVR_CODE(CL_INVALID_CONTEXT);
    VDVR_CODE(CL_INVALID_COMMAND_QUEUE);
    VDVR_CODE(CL_INVALID_MEM_OBJECT);
    VDVR_CODE(CL_INVALID_IMAGE_FORMAT_DESCRIPTOR);
    VDVR_CODE(CL_INVALID_IMAGE_SIZE);
    VDVR_CODE(CL_INVALID_SAMPLER);
    VDVR_CODE(CL_INVALID_BINARY);
    VDVR_CODE(CL_INVALID_BUILD_OPTIONS);
    VDVR_CODE(CL_INVALID_PROGRAM);
    VDVR_CODE(CL_INVALID_PROGRAM_EXECUTABLE);
    VDVR_CODE(CL_INVALID_KERNEL_NAME);
    VDVR_CODE(CL_INVALID_KERNEL);
    VDVR_CODE(CL_INVALID_ARG_INDEX);
    VDVR_CODE(CL_INVALID_ARG_VALUE);
    VDVR_CODE(CL_INVALID_ARG_SIZE);
    VDVR_CODE(CL_INVALID_KERNEL_ARGS);
    VDVR_CODE(CL_INVALID_WORK_DIMENSION);
    VDVR_CODE(CL_INVALID_WORK_GROUP_SIZE);
    VDVR_CODE(CL_INVALID_WORK_ITEM_SIZE);
    VDVR_CODE(CL_INVALID_GLOBAL_OFFSET);
    VDVR_CODE(CL_INVALID_EVENT);
    VDVR_CODE(CL_INVALID_OPERATION);
    VDVR_CODE(CL_INVALID_BUFFER_SIZE);
    VDVR_CODE(CL_INVALID_GLOBAL_WORK_SIZE);
    case -1001:
      return "CL_PLATFORM_NOT_FOUND_KHR (-1001)";
    default:
      return "OpenCL code " + std::to_string(code);
  }
#undef VDVR_CODE
}

}  // namespace vdvr::opencl
