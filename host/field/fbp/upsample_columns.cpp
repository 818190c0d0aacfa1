// Launcher of kernels/field/fbp/upsample_columns.cl.
#include "host/field/fbp/upsample_columns.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

#include "host/base/opencl/column_tuning.hpp"
#include "host/base/opencl/kernel.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "shared/upsample_columns.h"

namespace vdvr {

static_assert(sizeof(VdvrFinerColumns) == 88);

namespace {

using std::numbers::pi;
constexpr std::uint64_t most_scratch = std::uint64_t{256} << 20;

// The convolution's values at -columns .. columns do not meet those of another period.
std::int64_t length_of(std::int64_t columns) {
  return static_cast<std::int64_t>(std::bit_ceil(count(std::max<std::int64_t>(4, 3 * columns))));
}

// The kernel at its distances -2 columns + 1 .. columns, less a half: a row's mirror image is what the row
// gives at the negative position, so that the rows alone are transformed.
std::vector<double> half_way_kernel(std::int64_t columns) {
  std::vector<double> kernel;
  for (std::int64_t n = -2 * columns + 1; n <= columns; ++n)
    kernel.push_back(cosine_kernel(columns, static_cast<double>(n) - 0.5));
  return kernel;
}

std::vector<std::complex<double>> roots_of(std::int64_t length) {
  std::vector<std::complex<double>> root;
  for (std::int64_t j = 0; j < length; ++j)
    root.push_back(std::polar(1.0, -2 * pi * (static_cast<double>(j) / static_cast<double>(length))));
  return root;
}

std::int64_t bit_reversed(std::int64_t i, std::int64_t length) {
  std::int64_t out = 0;
  for (std::int64_t bit = 1; bit < length; bit *= 2) out = 2 * out + ((i & bit) != 0 ? 1 : 0);
  return out;
}

// In the order of `forward`; the inverse's 1 / length, a power of two, goes with it.
std::vector<std::complex<double>> spectrum_of(std::int64_t columns,
                                              const std::vector<std::complex<double>>& root) {
  const auto length = static_cast<std::int64_t>(root.size());
  const std::vector<double> kernel = half_way_kernel(columns);
  std::vector<std::complex<double>> spectrum(root.size());
  parallel_for(length, {}, "", [&](std::int64_t i) {
    const std::int64_t bin = bit_reversed(i, length);
    std::complex<double> sum = 0;
    for (std::size_t n = 0; n < kernel.size(); ++n) {
      const std::int64_t distance = static_cast<std::int64_t>(n) - 2 * columns + 1;
      sum += kernel[n] * root[at(((bin * distance) % length + length) % length)];
    }
    spectrum[at(i)] = sum / static_cast<double>(length);
  });
  return spectrum;
}

opencl::DeviceArray<double> on_device(opencl::State& state, const std::vector<std::complex<double>>& values,
                                      const char* what) {
  std::vector<double> flat;
  for (const std::complex<double>& v : values) flat.insert(flat.end(), {v.real(), v.imag()});
  return {state, std::span<const double>(flat), what};
}

// The modified Bessel function I0.
double bessel(double x) {
  double sum = 1, term = 1;
  for (int n = 1; term > 1e-17 * sum; ++n) sum += term *= std::pow(x / (2 * n), 2);
  return sum;
}

}  // namespace

std::vector<double> taps_between_half_columns(double place, int taps) {
  // The window's main lobe ends pi / 2 a node off.
  const double half = taps / 2.0, beta = std::sqrt(std::pow(half * pi / 2, 2) - pi * pi);
  std::vector<double> out;
  for (int n = 1 - taps / 2; n <= taps / 2; ++n) {
    const double d = n - place, r = d / half;
    const double sinc = d == 0 ? 1 : std::sin(pi * d) / (pi * d);
    out.push_back(sinc * bessel(beta * std::sqrt(std::max(0.0, 1 - r * r))) / bessel(beta));
  }
  return out;
}

double half_column_error(std::int64_t columns) {
  constexpr double u = 0x1p-53;
  const std::int64_t length = length_of(columns);
  const std::vector<double> kernel = half_way_kernel(columns);
  double sum = 0;
  for (const double k : kernel) sum += std::abs(k);
  // Relative to the norm: a stage of radix 4 is two complex additions and a product with a root, of some
  // rounding each; 32 u a stage of radix 2 hold that. Two rows share a transform: their norm is at most
  // sqrt(2) that of the larger, to which either's bound refers.
  const double stages = std::log2(static_cast<double>(length)), transform = 32 * u * stages;
  const double spectrum = (static_cast<double>(kernel.size()) + 40) * u * sum;
  // A value is the sum of two of the convolution's.
  return 2 * std::numbers::sqrt2 * 1.01 * ((2 * transform + 8 * u) * sum + spectrum);
}

bool ColumnUpsampling::is_possible(const opencl::State& state) {
  return state.device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0;
}

ColumnUpsampling::ColumnUpsampling(opencl::State& state, std::int64_t columns, int rate)
    : state_(state), columns_(columns), length_(length_of(columns)), rate_(rate) {
  const std::vector<std::complex<double>> root = roots_of(length_);
  root_ = on_device(state, root, "roots of unity");
  spectrum_ = on_device(state, spectrum_of(columns, root), "spectrum between columns");
  const int phases = rate / 2;
  std::vector<double> taps(half_column_taps, 0.0);
  for (int p = 1; p < phases; ++p) {
    const std::vector<double> of_phase = taps_between_half_columns(static_cast<double>(p) / phases);
    taps.insert(taps.end(), of_phase.begin(), of_phase.end());
  }
  taps_ = opencl::DeviceArray<double>(state, std::span<const double>(taps), "taps between half columns");
}

void ColumnUpsampling::operator()(const opencl::DeviceArray<float>& out, const VdvrChunks& out_places,
                                  const opencl::DeviceArray<float>& in, const VdvrChunks& in_places,
                                  const UpsampledColumns& columns, std::int64_t views, std::int64_t chunks) {
  const ColumnTuning tuning = column_tuning(state_.info);
  const std::uint64_t lanes = tuning.lanes == 1 ? 1 : 4, width = tuning.lanes == 1 ? 32 : 1;
  const std::int64_t phases = rate_ / 2, before = (columns.pad + phases - 1) / phases;
  const std::int64_t after = (columns.count - columns.pad) / phases + 1 - 2 * columns_;
  const std::int64_t margin = std::max(before, after) + half_column_taps / 2 + 1;
  const std::uint64_t slot = 2 * lanes * count(length_ + 2 * columns_ + 1 + 2 * margin);
  const std::uint64_t tasks = count(views * chunks) * 8 / lanes;
  std::uint64_t slots = std::min(tasks, std::uint64_t{state_.info.compute_units} * (lanes == 1 ? 128 : 4));
  slots = opencl::round_up(std::clamp<std::uint64_t>(most_scratch / (8 * slot), 1, slots), width);
  // A slot more or less changes no value; a GPU may allow little in one piece, and --max-memory in all.
  const std::uint64_t most =
      std::min(state_.info.max_allocation, state_.memory.left() / 4 + 8 * scratch_.size());
  while (slots > width && 8 * slots * slot > most) slots -= width;
  if (scratch_.size() < slots * slot) {
    scratch_ = {};  // before the next one is allocated
    scratch_ = opencl::DeviceArray<double>(state_, slots * slot, "rows between columns");
  }
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrFinerColumns>
      kernel(state_, "field/fbp/upsample_columns", "upsample_columns",
             {{"VDVR_LANES", std::to_string(lanes)},
              {"VDVR_DOUBLE", "1"},
              {"VDVR_TAPS", std::to_string(half_column_taps)},
              {"VDVR_WIDTH", std::to_string(width)}});
  const VdvrFinerColumns shape{.in = in_places,
                               .out = out_places,
                               .columns = to_int(columns_),
                               .length = to_int(length_),
                               .rate = rate_,
                               .pad = to_int(columns.pad),
                               .count = to_int(columns.count),
                               .margin = to_int(margin),
                               .views = to_int(views),
                               .chunks = to_int(chunks),
                               .slots = to_int(static_cast<std::int64_t>(slots)),
                               .reserved = 0};
  kernel({{slots, 1, 1}, {width, 1, 1}}, out.buffer(), in.buffer(), root_.buffer(), spectrum_.buffer(),
         taps_.buffer(), scratch_.buffer(), shape);
}

}  // namespace vdvr
