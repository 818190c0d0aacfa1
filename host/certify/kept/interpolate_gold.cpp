// Launcher of kernels/certify/kept/interpolate.cl.
#include "host/certify/kept/interpolate_gold.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "host/base/opencl/column_tuning.hpp"
#include "host/base/opencl/work_groups.hpp"
#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"

namespace vdvr {

static_assert(sizeof(VdvrColumns) == 24 && sizeof(VdvrAlongZ) == 56 && sizeof(VdvrAcross) == 120);

namespace {

constexpr std::int64_t lanes_of_group = 16;
// Bytes of local memory for kept columns of a work-group: half of what every device has.
constexpr std::uint64_t room = std::uint64_t{16} << 10;

opencl::Defines defines(int lanes, int taps) {
  return {{"VDVR_LANES", std::to_string(lanes)},
          {"VDVR_RUN", std::to_string(AlongZ::run)},
          {"VDVR_TAPS", std::to_string(taps)}};
}

// Of the phases between two nodes, a work-item sums so many at a time, for which there is a kernel. Where
// there is one, two intervals at a time: sums that share what they read.
int phases_together(int phases) { return phases <= 2 ? 1 : phases == 4 ? 3 : 4; }
int intervals_together(int phases) { return phases <= 2 ? 2 : 1; }

// Of which kernel a work-item does so many columns.
struct AlongKernel {
  const char* name = "along_z";
  int columns = 8;
  std::uint32_t together = 4;  // work-items of a work-group, with columns beside one another
};
AlongKernel along_kernel(int chains) {
  switch (chains) {
    case 2:
      return {"along_z_in_two", 4, 8};
    case 4:
      return {"along_z_in_four", 3, 4};
    default:
      return {};
  }
}

// Sums of vectors that take two registers each do not fit into those of a CPU with 8 lanes: those of runs,
// with two sums beside each, and of four chains. Two chains of four columns do.
int lanes_along_z(opencl::State& state, int chains) {
  const int tuned = column_tuning(state.info).lanes;
  return chains != 2 && tuned == 16 && state.device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>() <= 8
             ? 8
             : tuned;
}

// Whole groups of the phases that a work-item makes together.
std::vector<float> padded(int phases, int taps, std::span<const float> weights) {
  const std::int64_t together = phases_together(phases), wanted = phases - 1;
  std::vector<float> out(at(std::max<std::int64_t>(1, (wanted + together - 1) / together * together) * taps),
                         0.0f);
  std::copy(weights.begin(), weights.end(), out.begin());
  return out;
}

}  // namespace

HeightWeights height_weights(std::span<const double> matrix, std::int64_t outputs, std::int64_t inputs,
                             int chains) {
  if (inputs < 1) throw std::logic_error("height_weights: no input");
  HeightWeights out;
  const std::int64_t groups = (outputs + lanes_of_group - 1) / lanes_of_group;
  std::vector<std::int64_t> low(at(groups), inputs), high(at(groups), -1);
  for (std::int64_t i = 0; i < outputs; ++i)
    for (std::int64_t j = 0; j < inputs; ++j)
      if (matrix[at(i * inputs + j)] != 0) {
        low[at(i / lanes_of_group)] = std::min(low[at(i / lanes_of_group)], j);
        high[at(i / lanes_of_group)] = std::max(high[at(i / lanes_of_group)], j);
      }
  const std::int64_t run = chains > 0 ? 1 : AlongZ::run;
  const auto in_runs = [run](std::int64_t n) { return (n + run - 1) / run * run; };
  out.chains = chains;
  out.terms = run;
  for (std::int64_t group = 0; group < groups; ++group)
    out.terms = std::max(out.terms, in_runs(high[at(group)] + 1) - low[at(group)] / run * run);
  out.weights.assign(at(groups * out.terms * lanes_of_group), 0.0f);
  for (std::int64_t group = 0; group < groups; ++group) {
    const std::int64_t first =
        std::clamp<std::int64_t>(low[at(group)] / run * run, 0, in_runs(inputs) - out.terms);
    out.first.push_back(to_int(first));
    for (std::int64_t lane = 0; lane < lanes_of_group && group * lanes_of_group + lane < outputs; ++lane)
      for (std::int64_t j = 0; j < std::min(out.terms, inputs - first); ++j)
        out.weights[at((group * out.terms + j) * lanes_of_group + lane)] =
            static_cast<float>(matrix[at((group * lanes_of_group + lane) * inputs + first + j)]);
  }
  return out;
}

AlongZ::AlongZ(opencl::State& state, const HeightWeights& weights)
    : weights_(opencl::copied<float>(state, weights.weights, "weights of heights")),
      first_(opencl::copied<cl_int>(state, weights.first, "first heights")),
      chains_(weights.chains),
      terms_(weights.terms),
      groups_(weights.groups()) {}

void AlongZ::operator()(opencl::State& state, const opencl::DeviceArray<float>& in,
                        const opencl::DeviceArray<float>& out, std::span<const VdvrColumns> parts,
                        VdvrAlongZ shape) const {
  if (parts.empty()) return;
  shape.terms = to_int(terms_);
  shape.groups = to_int(groups_);
  shape.parts = to_int(static_cast<std::int64_t>(parts.size()));
  shape.columns_x = shape.columns_y = 0;
  for (const VdvrColumns& p : parts) {
    shape.columns_x = std::max(shape.columns_x, p.columns_x);
    shape.columns_y = std::max(shape.columns_y, p.columns_y);
  }
  const auto on_device = opencl::copied<VdvrColumns>(state, parts, "columns to interpolate");
  const int lanes = lanes_along_z(state, chains_);
  const auto [name, columns, together] = along_kernel(chains_);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrAlongZ> kernel(
      state, "certify/kept/interpolate", name, defines(lanes, 2));
  kernel(opencl::in_groups(
             state.info,
             {count(groups_ * lanes_of_group / lanes), count((shape.columns_x + columns - 1) / columns),
              count(std::int64_t{shape.columns_y} * shape.parts)},
             {1, together, 1}),
         out.buffer(), in.buffer(), weights_.buffer(), first_.buffer(), on_device.buffer(), shape);
}

AcrossWeights::AcrossWeights(opencl::State& state, int phases_of, int taps_of, std::span<const float> weights)
    : phases(phases_of),
      taps(taps_of),
      values(state, std::span<const float>(padded(phases_of, taps_of, weights)), "weights of gold") {}

void fill_across(opencl::State& state, const AcrossWeights& x, const AcrossWeights& y,
                 const opencl::DeviceArray<float>& in, const opencl::DeviceArray<float>& out,
                 VdvrAcross shape) {
  if (x.taps != y.taps) throw std::logic_error("fill_across: filters of different lengths");
  shape.phases_x = x.phases;
  shape.phases_y = y.phases;
  const int lanes = column_tuning(state.info).lanes, beside = intervals_together(x.phases);
  const auto columns = [&](std::int64_t intervals) {
    return (((intervals + beside - 2) * shape.step_x + x.taps) + 3) / 4 * 4;
  };
  opencl::Range range =
      opencl::in_groups(state.info, {count(shape.z / lanes), count(shape.outputs_y), count(shape.boxes)},
                        {lanes > 1 ? 1U : 16U, 1, 1});
  // Of a row as much as finds room, at least an interval; on a CPU the whole row does.
  const auto a_column = [&] { return 4 * count(lanes) * range.local[0] * range.local[1] * range.local[2]; };
  while (count(columns(1)) * a_column() > room && a_column() > 4 * count(lanes))
    *std::ranges::max_element(range.local) /= 2;
  std::int64_t most = 1;
  while (most < shape.intervals_x && count(columns(most + 1)) * a_column() <= room) ++most;
  const std::int64_t chunks = (shape.intervals_x + most - 1) / most,
                     chunk = (shape.intervals_x + chunks - 1) / chunks;
  shape.chunks = to_int(chunks);
  shape.chunk = to_int(chunk);
  shape.columns = to_int(columns(chunk));
  range.global[2] *= count(chunks);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrAcross, cl::LocalSpaceArg> kernel(
      state, "certify/kept/interpolate", fmt::format("across_{}", phases_together(x.phases)),
      defines(lanes, x.taps));
  kernel(range, out.buffer(), in.buffer(), x.values.buffer(), y.values.buffer(), shape,
         cl::Local(count(shape.columns) * a_column()));
}

}  // namespace vdvr
