// Builds embedded kernel programs, once per set of defines. And the names of OpenCL's codes, for error
// messages.
//
// Flags: -cl-std=CL1.2, and no relaxed arithmetic: what a certificate covers must round as the bound assumes.
// For the same reason no product is joined with a sum unless a kernel says fma. Warnings are errors in tests,
// which set VDVR_KERNEL_WARNINGS=error: one hid an uninitialised pointer that made certificates too good. In
// the field a compiler that we never saw may warn of what is right.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <set>
#include <sstream>
#include <thread>

#include "host/base/opencl/embedded.hpp"
#include "host/base/opencl/state.hpp"
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

std::size_t State::programs() {
  const std::lock_guard guard(programs_lock_);
  return programs_.size();
}

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
  cl::Program program;
  try {
    program = cl::Program(context, resolve_source(name + ".cl"));
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
  const std::lock_guard guard(programs_lock_);
  return programs_.emplace(key, std::move(program)).first->second;
}

const cl::Program& program(State& of_strand, const std::string& name, const Defines& defines) {
  State& state = of_strand.main_;
  const cl::Program& built = state.built(name, defines);
  const std::lock_guard guard(state.programs_lock_);
  const std::pair wanted{name, defines};
  if (std::ranges::find(state.asked_for_, wanted) == state.asked_for_.end()) {
    state.asked_for_.push_back(wanted);
    if (state.on_program) state.on_program(name, defines);
  }
  return built;
}

// --- ahead ---

namespace {

constexpr const char* list_head = "vdvr: programs of kernels that were asked for\n";
constexpr std::size_t most_ahead = 256;

// A program a line: its name, and its defines.
std::string listed(const std::vector<std::pair<std::string, Defines>>& programs) {
  std::string text = list_head;
  for (const auto& [name, defines] : programs) {
    text += name;
    for (const auto& [key, value] : defines) text += fmt::format(" {}={}", key, value);
    text += '\n';
  }
  return text + "end\n";
}

std::vector<std::pair<std::string, Defines>> programs_of(const std::string& text) {
  std::vector<std::pair<std::string, Defines>> out;
  if (!text.starts_with(list_head) || !text.ends_with("\nend\n")) return out;
  std::istringstream lines(text.substr(std::string_view(list_head).size()));
  for (std::string line; std::getline(lines, line) && line != "end" && out.size() < most_ahead;) {
    std::istringstream words(line);
    std::pair<std::string, Defines> program;
    words >> program.first;
    for (std::string word; words >> word;) {
      const std::size_t at = word.find('=');
      if (at == std::string::npos || !word.starts_with("VDVR_")) return {};
      program.second.emplace_back(word.substr(0, at), word.substr(at + 1));
    }
    out.push_back(std::move(program));
  }
  return out;
}

}  // namespace

// Builds, on a thread of its own, what a list of the cache folder names, and writes the list anew at the end.
class ProgramsAhead {
 public:
  ProgramsAhead(State& state, std::string file) : state_(state), file_(std::move(file)) {
    read_ = read_cached(file_).value_or("");
    std::vector<std::pair<std::string, Defines>> programs = programs_of(read_);
    if (programs.empty()) return;
    try {
      thread_ = std::thread([this, list = std::move(programs)] { build(list); });
    } catch (const std::exception&) {  // no thread to be had: programs are built when they are asked for
    }
  }
  ~ProgramsAhead() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    try {
      const std::string text = listed(state_.asked_for_);
      if (!state_.asked_for_.empty() && text != read_) write_cached(file_, text);
    } catch (const std::exception&) {  // no memory: the last list stays
    }
  }
  ProgramsAhead(const ProgramsAhead&) = delete;
  ProgramsAhead& operator=(const ProgramsAhead&) = delete;

 private:
  void build(const std::vector<std::pair<std::string, Defines>>& programs) noexcept {
    try {
      for (const auto& [name, defines] : programs) {
        if (stop_) return;
        state_.built(name, defines);
      }
    } catch (...) {  // whoever asks for it is told
    }
  }

  State& state_;
  std::string file_, read_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

void State::build_ahead(const std::string& purpose) {
  // It reads a program with all of the language's functions before it looks for it in its cache: 20 ms each.
  if (info.platform != pocl_platform || ahead_) return;
  const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
  {
    const std::lock_guard guard(programs_lock_);
    asked_for_.clear();
  }
  ahead_ = std::make_shared<ProgramsAhead>(
      *this,
      "programs/" + sha256_of_text(fmt::format("{}\n{}\n{}\n{}", purpose, info.name,
                                               platform.getInfo<CL_PLATFORM_VERSION>(), VDVR_VERSION)));
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
