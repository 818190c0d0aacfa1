// clFFT behind two functions.
#include "host/base/opencl/fft.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#include <clFFT.h>
#pragma GCC diagnostic pop
#include <fmt/format.h>

#include <cmath>
#include <complex>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "host/base/opencl/device_end.hpp"
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
      : handle(std::exchange(o.handle, 0)),
        context(std::move(o.context)),
        scratch(std::move(o.scratch)),
        compared(o.compared) {}
  Plan& operator=(Plan&&) = delete;

  clfftPlanHandle handle = 0;
  cl::Context context;  // keeps the context alive as long as the plan
  cl::Buffer scratch;
  bool compared = false;  // with what is right, at its first use
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

// A row of a buffer, as doubles. Waits.
std::vector<double> row_of(const opencl::State& state, Precision precision, const cl::Buffer& buffer,
                           std::size_t first, std::size_t count) {
  const auto read = [&]<class Real>(Real) {
    std::vector<Real> row(count);
    state.queue.enqueueReadBuffer(buffer, CL_TRUE, first * sizeof(Real), count * sizeof(Real), row.data());
    return std::vector<double>(row.begin(), row.end());
  };
  return precision == Precision::fp64 ? read(double{}) : read(float{});
}

// What a plan makes of a row in the middle is compared with the sums that define it, at some places: all of a
// long row would be its square. It may be off by what certificates charge a transform for, relative to the
// 2-norm of its result, and of its neighbour's, which may share it (docs/error-bounds.md, section 7).
class FirstUse {
 public:
  FirstUse(const opencl::State& state, Precision precision, std::int64_t length, std::int64_t batch,
           bool forward)
      : state_(state),
        precision_(precision),
        forward_(forward),
        length_(static_cast<std::size_t>(length)),
        row_(static_cast<std::size_t>(batch / 2)),
        neighbour_((row_ ^ 1u) < static_cast<std::size_t>(batch) ? row_ ^ 1u : row_),
        roots_(length_) {
    for (std::size_t i = 0; i < length_; ++i) {
      const double angle = 2 * std::numbers::pi * (static_cast<double>(i) / static_cast<double>(length_));
      roots_[i] = {std::cos(angle), std::sin(angle)};
    }
  }

  void read_input(const cl::Buffer& in) {
    const std::size_t numbers = forward_ ? length_ : 2 * bins();
    in_ = row_of(state_, precision_, in, row_ * numbers, numbers);
    beside_ = row_of(state_, precision_, in, neighbour_ * numbers, numbers);
  }
  // Whether this told anything: of zeros, and of what overflows, nothing is.
  [[nodiscard]] bool compare(const cl::Buffer& out) const {
    const double norm = std::sqrt(square_of_norm(in_) + square_of_norm(beside_));
    if (!(norm > 0) || !std::isfinite(norm)) return false;
    const std::size_t numbers = forward_ ? 2 * bins() : length_;
    const std::vector<double> is = row_of(state_, precision_, out, row_ * numbers, numbers);
    const bool doubles = precision_ == Precision::fp64;
    const double n = static_cast<double>(length_), unit = doubles ? 0x1p-53 : 0x1p-24,
                 least = doubles ? 0x1p-1022 : 0x1p-126, stages = std::log2(n) + 1;
    const double scale = forward_ ? std::sqrt(n) : 1 / std::sqrt(n);
    // The sums here are in double precision: n roundings each.
    const double allowed =
        700 * unit * stages * scale * norm + 20 * n * stages * least + n * 0x1p-52 * scale * norm;
    for (std::size_t k = 0; k < places_; ++k) {
      const std::size_t place = k * (numbers_of_result() - 1) / (places_ - 1);
      const std::complex<double> should = forward_ ? bin(place) : std::complex<double>(sample(place)),
                                 found = forward_ ? std::complex<double>(is[2 * place], is[2 * place + 1])
                                                  : std::complex<double>(is[place]);
      if (std::isfinite(std::abs(found)) && !(std::abs(found - should) <= allowed))
        throw DeviceError(fmt::format(
            "clFFT on '{}' (driver {}) errs: of a row of length {} it makes {:.9g} {:+.9g} i at place {}, "
            "where {:.9g} {:+.9g} i is right; choose another `device`",
            state_.info.name, state_.info.driver, length_, found.real(), found.imag(), place, should.real(),
            should.imag()));
    }
    return true;
  }

 private:
  static constexpr std::size_t places_ = 65;
  [[nodiscard]] std::size_t bins() const { return length_ / 2 + 1; }
  [[nodiscard]] std::size_t numbers_of_result() const { return forward_ ? bins() : length_; }
  // The bins that are not there are the conjugates of those that are, but for the first and the middle.
  [[nodiscard]] double times(std::size_t bin) const { return bin == 0 || 2 * bin == length_ ? 1.0 : 2.0; }
  // Of a row, or of all of its spectrum.
  [[nodiscard]] double square_of_norm(const std::vector<double>& row) const {
    double sum = 0;
    for (std::size_t i = 0; i < row.size(); ++i) sum += row[i] * row[i] * (forward_ ? 1.0 : times(i / 2));
    return sum;
  }
  [[nodiscard]] std::complex<double> bin(std::size_t k) const {
    std::complex<double> sum;
    for (std::size_t i = 0; i < length_; ++i) sum += in_[i] * std::conj(roots_[i * k % length_]);
    return sum;
  }
  [[nodiscard]] double sample(std::size_t i) const {
    double sum = 0;
    for (std::size_t k = 0; k < bins(); ++k)
      sum += times(k) * (std::complex<double>(in_[2 * k], in_[2 * k + 1]) * roots_[i * k % length_]).real();
    return sum / static_cast<double>(length_);
  }

  const opencl::State& state_;
  Precision precision_;
  bool forward_;
  std::size_t length_, row_, neighbour_;
  std::vector<std::complex<double>> roots_;
  std::vector<double> in_, beside_;
};

void transform(opencl::State& state, Precision precision, std::int64_t length, std::int64_t batch,
               bool forward, const cl::Buffer& in, const cl::Buffer& out) {
  const std::lock_guard guard(bake_lock);
  try {
    Plan& plan = plan_for(state, precision, length, batch, forward);
    std::optional<FirstUse> first;
    if (!plan.compared) first.emplace(state, precision, length, batch, forward);
    if (first) first->read_input(in);
    cl_mem source = in(), target = out();
    check(clfftEnqueueTransform(plan.handle, forward ? CLFFT_FORWARD : CLFFT_BACKWARD, 1, &state.queue(), 0,
                                nullptr, nullptr, &source, &target, plan.scratch()),
          "clfftEnqueueTransform", length, batch, state);
    if (first) plan.compared = first->compare(out);
  } catch (const cl::Error& e) {
    throw DeviceError(fmt::format("clFFT for {} rows of length {} on '{}': {} {}", batch, length,
                                  state.info.name, e.what(), opencl::code_name(e.err())));
  }
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
