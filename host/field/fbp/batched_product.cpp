// Launcher of kernels/field/fbp/batched_product.cl.
#include "host/field/fbp/batched_product.hpp"

#include <fmt/format.h>

#include "host/base/opencl/column_tuning.hpp"
#include "host/base/opencl/kernel.hpp"
#include "shared/batched_product.h"

namespace vdvr {

static_assert(sizeof(VdvrProduct) == 72);

void batched_product(opencl::State& state, const opencl::DeviceArray<float>& out,
                     const opencl::DeviceArray<float>& a, const opencl::DeviceArray<float>& v,
                     const ProductShape& s) {
  constexpr std::uint64_t rows_per_item = 8;
  for (const std::int64_t n : {s.rows, s.terms, s.z_padded, s.batches})
    if (n > INT32_MAX) throw InputError(fmt::format("a product's size of {} passes 2^31", n));
  const ColumnTuning tuning = column_tuning(state.info);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrProduct> kernel(
      state, "field/fbp/batched_product", "batched_product",
      {{"VDVR_LANES", std::to_string(tuning.lanes)}, {"VDVR_RUN", std::to_string(s.run)}});
  const auto count = [](std::int64_t n) { return static_cast<std::uint64_t>(n); };
  const auto ints = [](std::int64_t n) { return static_cast<cl_int>(n); };
  const VdvrProduct shape{.out = {s.out_first, s.out_batch, s.out_chunk},
                          .v = {0, s.v_batch, s.v_chunk},
                          .a_batch = s.a_batch,
                          .rows = ints(s.rows),
                          .terms = ints(s.terms),
                          .z_padded = ints(s.z_padded),
                          .batches = ints(s.batches)};
  kernel({{count(s.z_padded / tuning.lanes), opencl::round_up(count(s.rows), rows_per_item) / rows_per_item,
           count(s.batches)},
          {tuning.local[0], tuning.local[1], 1}},
         out.buffer(), a.buffer(), v.buffer(), shape);
}

}  // namespace vdvr
