// Launches kernels/field/fbp/axis_product.cl.
#include "host/field/fbp/axis_product.hpp"

#include <vector>

namespace vdvr {

static_assert(sizeof(VdvrAxisProduct) == 24);

opencl::DeviceArray<float> transposed_on_device(opencl::State& state, std::span<const double> exact,
                                                std::int64_t n) {
  const auto width = static_cast<std::size_t>(n);
  std::vector<float> at(exact.size());
  for (std::size_t m = 0; m < width; ++m)
    for (std::size_t j = 0; j < width; ++j) at[j * width + m] = static_cast<float>(exact[m * width + j]);
  return {state, std::span<const float>(at), "matrix of an axis"};
}

AxisProduct::AxisProduct(opencl::State& state) : kernel_(state, "field/fbp/axis_product", "axis_product") {}

void AxisProduct::operator()(const opencl::DeviceArray<float>& out, const opencl::DeviceArray<float>& in,
                             const opencl::DeviceArray<float>& matrix, std::int64_t outer, std::int64_t n,
                             std::int64_t inner) {
  const auto i = [](std::int64_t v) { return static_cast<cl_int>(v); };
  const bool fast = inner == 1;  // then lines are the rows and coefficients the columns
  const std::int64_t batches = fast ? 1 : outer, rows = fast ? outer : n, columns = fast ? n : inner;
  const auto groups = [](std::int64_t v, std::int64_t by) {
    return static_cast<std::uint64_t>((v + by - 1) / by);
  };
  const VdvrAxisProduct shape{.batches = i(batches),
                              .rows = i(rows),
                              .terms = i(n),
                              .columns = i(columns),
                              .s_row = i(fast ? n : 1),
                              .s_term = i(fast ? 1 : n)};
  kernel_({{groups(columns, 16), groups(rows, 4), groups(batches, 1)}, {4, 8, 1}}, out.buffer(),
          fast ? in.buffer() : matrix.buffer(), fast ? matrix.buffer() : in.buffer(), shape);
}

}  // namespace vdvr
