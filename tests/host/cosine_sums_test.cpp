// Cosine sums along v against sums of a longer type.
#define BOOST_TEST_MODULE cosine_sums
#include "host/verify/witness/cosine_sums.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>

using namespace vdvr;

// Columns are summed several at a time, and what is left one by one: all numbers of them.
BOOST_AUTO_TEST_CASE(every_column_and_row_has_its_sum) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1, 1);
  for (const std::int64_t U : {1, 5, 6, 7, 12, 17})
    for (const std::int64_t rows : {8, 16, 24}) {
      const std::int64_t V = 9;
      std::vector<double> a(static_cast<std::size_t>(U * V)), basis(static_cast<std::size_t>(V * rows)),
          line(static_cast<std::size_t>(U * rows), 1e9);
      for (double& x : a) x = value(random);
      for (double& x : basis) x = value(random);
      cosine_sums::sum_rows(a.data(), U, V, basis, rows, line);
      for (std::int64_t m = 0; m < U; ++m)
        for (std::int64_t r = 0; r < rows; ++r) {
          long double sum = 0, magnitudes = 0;
          for (std::int64_t l = 0; l < V; ++l) {
            const long double term = static_cast<long double>(a[static_cast<std::size_t>(m * V + l)]) *
                                     static_cast<long double>(basis[static_cast<std::size_t>(l * rows + r)]);
            sum += term;
            magnitudes += std::abs(term);
          }
          // A product and at most V sums, each a rounding of what came before.
          const auto bound = static_cast<double>(magnitudes) * static_cast<double>(V + 1) * 0x1p-53;
          BOOST_TEST(std::abs(line[static_cast<std::size_t>(m * rows + r)] - static_cast<double>(sum)) <=
                     bound);
        }
    }
}
