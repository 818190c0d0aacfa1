#define BOOST_TEST_MODULE axis_product
#include "host/field/fbp/axis_product.hpp"

#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "host/field/fbp/cosine_series.hpp"
#include "tests/reference/cosine_series.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;

// The cosine coefficients of a block along its middle axis, beside the direct sums of the reference.
BOOST_AUTO_TEST_CASE(products_along_an_axis_match_direct_sums) {
  opencl::State& state = support::device().state();
  AxisProduct axis(state);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (const auto& [outer, n, inner] :
       {std::array<std::size_t, 3>{1, 1, 1}, {1, 67, 1}, {3, 65, 1}, {1, 70, 5}, {33, 9, 17}, {2, 129, 2}}) {
    std::vector<float> values(outer * n * inner);
    for (float& v : values) v = unit(random);
    const opencl::DeviceArray<float> in(state, std::span<const float>(values), "in"),
        out(state, values.size(), "out");
    const auto length = static_cast<std::int64_t>(n);
    const auto matrix = transposed_on_device(state, analysis_matrix(length), length);
    axis(out, in, matrix, static_cast<std::int64_t>(outer), length, static_cast<std::int64_t>(inner));
    const std::vector<float> computed = out.to_host();
    // Entries of up to 2 / n in magnitude meet sums of up to n values.
    const double rounding = tolerance::fp32_sum(length + 1, 2);
    for (std::size_t o = 0; o < outer; ++o)
      for (std::size_t i = 0; i < inner; ++i) {
        std::vector<double> line;
        for (std::size_t j = 0; j < n; ++j)
          line.push_back(static_cast<double>(values[(o * n + j) * inner + i]));
        const auto expected = reference::cosine_coefficients(line);
        for (std::size_t j = 0; j < n; ++j)
          BOOST_TEST(std::abs(static_cast<double>(computed[(o * n + j) * inner + i]) - expected[j]) <=
                     rounding);
      }
  }
}
