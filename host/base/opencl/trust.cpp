#include "host/base/opencl/trust.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <utility>

#include "host/base/opencl/device_end.hpp"
#include "host/base/opencl/embedded.hpp"
#include "host/base/opencl/kernel.hpp"
#include "host/base/opencl/trust_checks.hpp"
#include "host/base/system/cache_files.hpp"
#include "shared/trust.h"
#include "vdvr/expert/hash.hpp"

namespace vdvr::opencl {
namespace {

// The C99 struct VdvrGrid of kernels/shared/mixed_sampler.h, as trust_checks.cpp has it.
struct TrustGrid {
  cl_int cells[3]{8, 8, 8}, granularity = 4, bricks[3]{2, 2, 2};
  cl_float step = 0x1p-10f;
  cl_int coarse[3]{1, 0, 0}, lit_samples = 0;
};
static_assert(sizeof(TrustGrid) == 48);

bool has_double(const State& state) { return state.device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0; }

Defines defines_for(const State& state) {
  return {{"VDVR_SAMPLE_TYPES", "7"}, {"VDVR_RECORDS", "1"}, {"VDVR_DOUBLE", has_double(state) ? "1" : "0"}};
}

template <class T>
DeviceArray<T> given(State& state, const std::vector<T>& values) {
  return {state, std::span<const T>(values), "numbers of a device's test"};
}

// What was wrong, by check, in the order of the lines.
class Findings {
 public:
  explicit Findings(bool flushes) : flushes_(flushes) {}
  void add(const std::string& check, const std::string& what) {
    auto at =
        std::find_if(checks.begin(), checks.end(), [&](const DeviceCheck& c) { return c.name == check; });
    if (at == checks.end()) at = checks.insert(checks.end(), {check, ""});
    if (!what.empty()) at->found += (at->found.empty() ? "" : "; ") + what;
  }
  template <class T>
  void compare(const std::vector<TrustLine>& lines, const std::vector<T>& got) {
    const std::size_t each = got.size() / lines.size();
    for (std::size_t l = 0; l < lines.size(); ++l) {
      const std::vector<std::uint64_t> answers(got.begin() + static_cast<std::ptrdiff_t>(l * each),
                                               got.begin() + static_cast<std::ptrdiff_t>((l + 1) * each));
      add(lines[l].check, wrong_answers(lines[l], answers, flushes_));
    }
  }
  std::vector<DeviceCheck> checks;

 private:
  bool flushes_;
};

}  // namespace

std::string identity(const State& state) {
  const DeviceInfo& d = state.info;
  // Of the platform too: PoCL names its compiler there alone.
  const cl::Platform platform(state.device.getInfo<CL_DEVICE_PLATFORM>());
  std::string text;
  for (const std::string& part :
       {d.platform, platform.getInfo<CL_PLATFORM_VERSION>(), d.name, d.vendor, d.version, d.driver,
        std::string(VDVR_VERSION), build_options(defines_for(state)),
        sha256_of_text(resolve_source("base/opencl/trust.cl"))})
    text += part + '\n';
  for (const bool flag : {d.is_gpu, d.is_cpu, has_double(state), d.subnormals}) text += flag ? '1' : '0';
  return text + '\n';
}

DeviceTest ask_device(State& state) {
  const auto start = std::chrono::steady_clock::now();
  const TrustInputs in = trust_inputs();
  const Defines defines = defines_for(state);
  const auto values = given(state, in.values);
  const auto whole = given(state, in.whole);
  Findings findings(!state.info.subnormals);
  const Range all{{VDVR_TRUST_VALUES, 1, 1}, {1, 1, 1}};
  {
    const std::vector<cl_int> none{0, std::numeric_limits<cl_int>::min(), 0, 0};
    const auto totals = given(state, none);
    const DeviceArray<cl_uint> out(state, VDVR_TRUST_SCALAR * VDVR_TRUST_VALUES,
                                   "answers of a device's test");
    Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer> kernel(state, "base/opencl/trust", "trust_scalar",
                                                                  defines);
    kernel(all, out.buffer(), totals.buffer(), values.buffer(), whole.buffer());
    findings.compare(scalar_lines(in), out.to_host());
    const auto should = atomic_totals(in);
    const std::vector<cl_int> is = totals.to_host();
    findings.add("atomics", std::equal(is.begin(), is.end(), should.begin()) ? "" : "a total is wrong");
  }
  {
    const DeviceArray<cl_uint> out(state, VDVR_TRUST_VECTOR * VDVR_TRUST_VALUES,
                                   "answers of a device's test");
    Kernel<cl::Buffer, cl::Buffer, cl::Buffer> kernel(state, "base/opencl/trust", "trust_vector", defines);
    kernel({{VDVR_TRUST_VALUES / 8, 1, 1}, {1, 1, 1}}, out.buffer(), values.buffer(), whole.buffer());
    findings.compare(vector_lines(in), out.to_host());
  }
  {
    std::vector<cl_float4> points;
    for (const auto& p : in.points) points.push_back({{p[0], p[1], p[2], p[3]}});
    const auto at = given(state, points);
    const auto samples = given(state, in.samples);
    const auto records = given(state, in.records);
    const DeviceArray<cl_uint> out(state, VDVR_TRUST_POINTS, "answers of a device's test");
    Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, TrustGrid> kernel(state, "base/opencl/trust",
                                                                             "trust_sampler", defines);
    kernel({{VDVR_TRUST_POINTS, 1, 1}, {1, 1, 1}}, out.buffer(), samples.buffer(), records.buffer(),
           at.buffer(), TrustGrid{});
    findings.compare({sampler_line(in)}, out.to_host());
  }
  if (has_double(state)) {
    const auto doubles = given(state, in.doubles);
    const DeviceArray<cl_ulong> out(state, VDVR_TRUST_DOUBLE * VDVR_TRUST_VALUES,
                                    "answers of a device's test");
    Kernel<cl::Buffer, cl::Buffer> kernel(state, "base/opencl/trust", "trust_double", defines);
    kernel(all, out.buffer(), doubles.buffer());
    findings.compare(double_lines(in), out.to_host());
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  return {std::move(findings.checks), false, took.count()};
}

DeviceTest test_device(State& state) {
  const std::string text = "vdvr: a device that passed its test\n" + identity(state),
                    name = "devices/" + sha256_of_text(text);
  // The checks' names follow, so that a remembered device shows them.
  if (const auto known = read_cached(name); known && known->starts_with(text)) {
    DeviceTest test;
    test.remembered = true;
    for (std::size_t at = text.size(), end; (end = known->find('\n', at)) != std::string::npos; at = end + 1)
      test.checks.push_back({known->substr(at, end - at), ""});
    if (known->ends_with("\nend\n")) {
      test.checks.pop_back();
      return test;
    }
  }
  DeviceTest test = ask_device(state);
  if (!test.passed()) return test;
  std::string remembered = text;
  for (const DeviceCheck& check : test.checks) remembered += check.name + '\n';
  write_cached(name, remembered + "end\n");
  return test;
}

namespace {

// Beside the states, which other rooms know: by the state, until its device ends.
struct Opened {
  std::mutex lock;
  std::map<const State*, DeviceTest> tests;
  std::function<void(const std::string&)> tell;
  std::string last;  // name of the device opened last
};
Opened& opened() {
  static auto* one = new Opened;  // devices may end after statics
  return *one;
}
std::atomic<bool> untrusted_opened{false};

void forget(const State& state) noexcept {
  const std::lock_guard guard(opened().lock);
  opened().tests.erase(&state);
}

const DeviceTest& test_of(const State& state) {
  const std::lock_guard guard(opened().lock);
  return opened().tests.at(&state);
}

}  // namespace

void keep_test(const State& state, DeviceTest test) {
  static const bool listening = (before_device_ends(forget), true);
  static_cast<void>(listening);
  const std::lock_guard guard(opened().lock);
  opened().tests[&state] = std::move(test);
  opened().last = state.info.name;
}

void tell(const std::string& line) {
  std::function<void(const std::string&)> listener;
  {
    const std::lock_guard guard(opened().lock);
    listener = opened().tell;
  }
  if (listener) listener(line);
}

bool untrusted_are_opened() { return untrusted_opened; }

void require_trusted(const State& state, const std::string& what) {
  const DeviceTest& test = test_of(state);
  if (test.passed()) return;
  throw DeviceError(
      fmt::format("{} needs a device that computes as certificates assume, and '{}' (driver {}) failed its "
                  "test: {}; choose another `device`",
                  what, state.info.name, state.info.driver, test.failures()));
}

}  // namespace vdvr::opencl

namespace vdvr {

bool DeviceTest::passed() const {
  return std::all_of(checks.begin(), checks.end(), [](const DeviceCheck& c) { return c.found.empty(); });
}

std::string DeviceTest::failures() const {
  std::string text;
  for (const DeviceCheck& c : checks) {
    if (c.found.empty()) continue;
    const std::size_t first = c.found.find("; ");
    text += fmt::format("{}{} ({}{})", text.empty() ? "" : ", ", c.name, c.found.substr(0, first),
                        first == std::string::npos ? "" : ", ...");
  }
  return text;
}

std::string DeviceTest::names() const {
  std::string text;
  for (const DeviceCheck& c : checks) text += (text.empty() ? "" : ", ") + c.name;
  return text;
}

const DeviceTest& test_of(Device& device) { return opencl::test_of(device.state()); }

void tell_of_devices(std::function<void(const std::string&)> tell) {
  const std::lock_guard guard(opencl::opened().lock);
  opencl::opened().tell = std::move(tell);
}

std::string words_for(const std::exception& e) {
  const auto* call = dynamic_cast<const cl::Error*>(&e);
  if (call == nullptr) return e.what();
  const std::lock_guard guard(opencl::opened().lock);
  return fmt::format("'{}' failed: {} {}", opencl::opened().last, call->what(),
                     opencl::code_name(call->err()));
}

void open_untrusted_devices(bool open) { opencl::untrusted_opened = open; }
void require_trusted(Device& device, const std::string& what) {
  opencl::require_trusted(device.state(), what);
}

}  // namespace vdvr
