// clFFT behind two functions. Called by host/fbp/filter_rows.cpp.
#include "host/opencl/fft.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#include <clFFT.h>
#pragma GCC diagnostic pop
#include <fmt/format.h>

#include <array>
#include <map>
#include <mutex>
#include <tuple>
#include <utility>

#include "host/opencl/device_end.hpp"
#include "vdvr/error.hpp"

namespace vdvr::fft {
namespace {

void check(clfftStatus status, const char* call, std::int64_t length, std::int64_t batch,
           const opencl::State& state) {
  if (status != CLFFT_SUCCESS) {
    throw DeviceError(fmt::format("{} for {} rows of length {} on '{}': {}", call, batch, length,
                                  state.info.name, opencl::code_name(static_cast<int>(status))));
  }
}

struct Library {
  Library() {
    clfftSetupData setup;
    clfftInitSetupData(&setup);
    clfftSetup(&setup);
  }
  ~Library() { clfftTeardown(); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
};

struct Plan {
  Plan() = default;
  ~Plan() {
    if (handle != 0) clfftDestroyPlan(&handle);
  }
  Plan(Plan&& o) noexcept
      : handle(std::exchange(o.handle, 0)), context(std::move(o.context)), scratch(std::move(o.scratch)) {}
  Plan& operator=(Plan&&) = delete;

  clfftPlanHandle handle = 0;
  cl::Context context;  // keeps the context alive as long as the plan
  cl::Buffer scratch;
};

using Key = std::tuple<cl_context, cl_command_queue, Precision, std::int64_t, std::int64_t, bool>;

struct Cache {
  Library library;
  std::map<Key, Plan> plans;
};

std::mutex bake_lock;
// Under the lock. There as long as a device has plans, since clFFT keeps kernels until it is torn down. Not a
// static with a destructor: a static Device may end after that.
constinit Cache* cache = nullptr;

void forget(const opencl::State& state) noexcept {
  const std::lock_guard guard(bake_lock);
  if (!cache) return;
  std::erase_if(cache->plans, [&](const auto& p) { return std::get<0>(p.first) == state.context(); });
  if (cache->plans.empty()) delete std::exchange(cache, nullptr);
}

Plan& plan_for(opencl::State& state, Precision precision, std::int64_t length, std::int64_t batch,
               bool forward) {
  static const bool listening = (opencl::before_device_ends(forget), true);
  (void)listening;
  if (!cache) cache = new Cache;
  auto& plans = cache->plans;
  const Key key{state.context(), state.queue(), precision, length, batch, forward};
  if (const auto found = plans.find(key); found != plans.end()) return found->second;

  const auto n = static_cast<std::size_t>(length), bins = n / 2 + 1;
  Plan plan;
  plan.context = state.context;
  const auto ok = [&](clfftStatus s, const char* call) { check(s, call, length, batch, state); };
  ok(clfftCreateDefaultPlan(&plan.handle, state.context(), CLFFT_1D, &n), "clfftCreateDefaultPlan");
  ok(clfftSetPlanPrecision(plan.handle, precision == Precision::fp64 ? CLFFT_DOUBLE : CLFFT_SINGLE),
     "clfftSetPlanPrecision");
  ok(clfftSetResultLocation(plan.handle, CLFFT_OUTOFPLACE), "clfftSetResultLocation");
  ok(clfftSetPlanBatchSize(plan.handle, static_cast<std::size_t>(batch)), "clfftSetPlanBatchSize");
  if (forward) {
    ok(clfftSetLayout(plan.handle, CLFFT_REAL, CLFFT_HERMITIAN_INTERLEAVED), "clfftSetLayout");
    ok(clfftSetPlanDistance(plan.handle, n, bins), "clfftSetPlanDistance");
  } else {
    ok(clfftSetLayout(plan.handle, CLFFT_HERMITIAN_INTERLEAVED, CLFFT_REAL), "clfftSetLayout");
    ok(clfftSetPlanDistance(plan.handle, bins, n), "clfftSetPlanDistance");
  }
  ok(clfftBakePlan(plan.handle, 1, &state.queue(), nullptr, nullptr), "clfftBakePlan");
  std::size_t scratch = 0;
  ok(clfftGetTmpBufSize(plan.handle, &scratch), "clfftGetTmpBufSize");
  if (scratch > 0) plan.scratch = cl::Buffer(state.context, CL_MEM_READ_WRITE, scratch);
  return plans.emplace(key, std::move(plan)).first->second;
}

void transform(opencl::State& state, Precision precision, std::int64_t length, std::int64_t batch,
               bool forward, const cl::Buffer& in, const cl::Buffer& out) {
  const std::lock_guard guard(bake_lock);
  const Plan& plan = plan_for(state, precision, length, batch, forward);
  cl_mem source = in(), target = out();
  check(clfftEnqueueTransform(plan.handle, forward ? CLFFT_FORWARD : CLFFT_BACKWARD, 1, &state.queue(), 0,
                              nullptr, nullptr, &source, &target, plan.scratch()),
        "clfftEnqueueTransform", length, batch, state);
}

}  // namespace

std::int64_t good_length(std::int64_t n) {
  std::int64_t best = 0;
  for (const std::int64_t odd : {1, 3, 5}) {
    std::int64_t length = 2 * odd;
    while (length < n) length *= 2;
    if (best == 0 || length < best) best = length;
  }
  return best;
}

void forward_real(opencl::State& state, Precision precision, std::int64_t length, std::int64_t batch,
                  const cl::Buffer& in, const cl::Buffer& out) {
  transform(state, precision, length, batch, true, in, out);
}

void inverse_real(opencl::State& state, Precision precision, std::int64_t length, std::int64_t batch,
                  const cl::Buffer& in, const cl::Buffer& out) {
  transform(state, precision, length, batch, false, in, out);
}

}  // namespace vdvr::fft
