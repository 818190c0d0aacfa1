// Fits lattices on the device. Launches kernels/fit_coefficients.cl.
#include "host/fit_coefficients.hpp"

#include <utility>

#include "host/opencl/kernel.hpp"

namespace vdvr {
namespace {

// Of the middle of the errors around a sample: 1 would overshoot, since a shift moves the interpolant around
// the neighbours too.
constexpr float share = 0.8f;
// Room for 16-lane reads that begin at the last node of the last column.
constexpr std::uint64_t room = 64;

cl_int to_int(std::int64_t n) { return static_cast<cl_int>(n); }
std::uint64_t count(std::int64_t n) { return static_cast<std::uint64_t>(n); }

}  // namespace

LevelSamples fit_lattice(opencl::State& state, const GoldBlocks& b, const opencl::DeviceArray<float>& gold,
                         const opencl::DeviceArray<float>& margin, std::int64_t spacing, int steps,
                         float curvature) {
  LevelSamples l;
  l.spacing = spacing;
  l.reach = b.halo / spacing;
  l.cx = (b.nx - 1) / spacing + 1 + 2 * l.reach;
  l.cy = (b.ny - 1) / spacing + 1 + 2 * l.reach;
  l.cz = (b.nz - 1) / spacing + 1 + 2 * l.reach;
  l.stride = l.cz;
  const std::uint64_t columns = count(b.count * l.cx * l.cy);
  l.samples = opencl::DeviceArray<float>(state, columns * count(l.stride), "samples of a level");
  l.along = opencl::DeviceArray<float>(state, columns * count(b.gold_stride) + room, "interpolated columns");
  l.along.fill(0.0f);  // 16 lanes read beyond what is interpolated

  const cl_int nx = to_int(b.nx), ny = to_int(b.ny), halo = to_int(b.halo), stride = to_int(b.gold_stride),
               s = to_int(spacing), reach = to_int(l.reach), cx = to_int(l.cx), cy = to_int(l.cy),
               cz = to_int(l.cz), blocks = to_int(b.count);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int>
      take(state, "fit_coefficients", "take_lattice");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int>
      interpolate(state, "fit_coefficients", "interpolate_lattice");
  const opencl::Range per_sample{{count(l.cz), count(l.cx), count(l.cy * b.count)}, {16, 4, 1}};
  take(per_sample, l.samples.buffer(), gold.buffer(), nx, ny, halo, stride, s, reach, cx, cy, cz,
       to_int(l.stride), blocks);
  const auto along = [&] {
    interpolate({{count(l.cx), count(l.cy), count(b.count)}, {8, 8, 1}}, l.along.buffer(), l.samples.buffer(),
                halo, stride, s, reach, cx, cy, cz, to_int(l.stride), blocks);
  };
  along();
  if (steps == 0) return l;

  const opencl::DeviceArray<float> errors(state, gold.size(), "errors of an interpolant");
  const opencl::DeviceArray<float> low(state, columns * count(b.gold_stride), "smallest errors"),
      high(state, columns * count(b.gold_stride), "largest errors");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_float, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_float>
      err(state, "fit_coefficients", "lattice_errors");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_float, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int>
      pool(state, "fit_coefficients", "pool_errors");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_float>
      shift(state, "fit_coefficients", "shift_lattice");
  const std::uint64_t chunks = count(b.gold_stride / 16);
  // Columns that have a lattice column on every side within half a spacing.
  const std::int64_t wide = (l.cx - 1) * spacing + 1 - 2 * (spacing / 2),
                     deep = (l.cy - 1) * spacing + 1 - 2 * (spacing / 2);
  for (int step = 0; step < steps; ++step) {
    err({{chunks, count(wide), count(deep * b.count)}, {1, 4, 4}}, errors.buffer(), l.along.buffer(),
        gold.buffer(), margin.buffer(), b.lowest, nx, ny, halo, stride, s, reach, cx, cy, blocks, curvature);
    pool({{chunks, count(l.cx), count(l.cy * b.count)}, {1, 4, 4}}, low.buffer(), high.buffer(),
         errors.buffer(), margin.buffer(), b.lowest, nx, ny, halo, stride, s, reach, cx, cy, blocks);
    shift(per_sample, l.samples.buffer(), low.buffer(), high.buffer(), halo, stride, s, reach, cx, cy, cz,
          to_int(l.stride), blocks, to_int(b.z_first), to_int(b.z_last), share);
    along();
  }
  return l;
}

}  // namespace vdvr
