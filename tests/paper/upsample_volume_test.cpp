// Frequency-domain upsampling: waves of the cosine series are kept exactly, samples stay, sizes are met. And
// the spectrum, whose one coefficient such a wave is.
#define BOOST_TEST_MODULE upsample_volume
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <numbers>

#include "apps/paper/upsample_volume.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using namespace vdvr::paper;

namespace {

/// A product of cosines, one of the basis of the mirror extension of n samples; x in old samples.
double wave(const Index3& samples, const Index3& m, const Vec3& x) {
  double product = 1;
  for (std::size_t a = 0; a < 3; ++a)
    product *= std::cos(std::numbers::pi * static_cast<double>(m[a]) * (x[a] + 0.5) /
                        static_cast<double>(samples[a]));
  return product;
}

Volume wave_volume(const Index3& cells, const Index3& m) {
  Volume v;
  v.grid.cells = cells;
  v.grid.origin = {-3, 2, 5};
  v.grid.spacing = {0.5, 2, 1};
  const Index3 n = v.grid.samples();
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x)
        v.samples.push_back(static_cast<float>(
            wave(n, m, {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)})));
  return v;
}

/// Three passes, each rounding its result once and carrying the rounding of its input times the largest row
/// sum of a resampling matrix, which is below 2 + log of its length.
double rounding(const Index3& cells) {
  double growth = 1, sum = 1;
  for (const std::int64_t c : cells) {
    growth *= 2 + std::log(static_cast<double>(c + 1));
    sum += growth;
  }
  return sum * growth * tolerance::unit_roundoff;
}

}  // namespace

BOOST_AUTO_TEST_CASE(waves_below_nyquist_are_kept_at_every_new_sample) {
  const Index3 cells{8, 5, 6};
  for (const Index3& to : {Index3{16, 10, 12}, Index3{11, 7, 13}})
    for (const Index3& m : {Index3{0, 0, 0}, Index3{3, 2, 1}, Index3{8, 5, 6}}) {
      const Volume v = wave_volume(cells, m), up = upsample_volume(v, to);
      BOOST_TEST_REQUIRE(up.grid.cells == to);
      const Index3 n = v.grid.samples(), k = up.grid.samples();
      double worst = 0;
      for (std::int64_t i = 0; i < up.grid.sample_count(); ++i) {
        const Vec3 p = up.grid.position({i % k[0], i / k[0] % k[1], i / (k[0] * k[1])});
        Vec3 at{};
        for (std::size_t a = 0; a < 3; ++a) at[a] = (p[a] - v.grid.origin[a]) / v.grid.spacing[a];
        worst = std::max(
            worst, std::abs(static_cast<double>(up.samples[static_cast<std::size_t>(i)]) - wave(n, m, at)));
      }
      BOOST_TEST(worst <= rounding(cells));
    }
}

BOOST_AUTO_TEST_CASE(old_samples_keep_their_values) {
  Volume v = wave_volume({4, 4, 4}, {1, 1, 1});
  for (std::size_t i = 0; i < v.samples.size(); ++i) v.samples[i] = static_cast<float>(i * 7919 % 101) / 101;
  const Volume up = upsample_volume(v, {8, 12, 4});
  for (std::int64_t z = 0; z < 5; ++z)
    for (std::int64_t y = 0; y < 5; ++y)
      for (std::int64_t x = 0; x < 5; ++x)
        BOOST_TEST(std::abs(up.samples[static_cast<std::size_t>((z * 13 + 3 * y) * 9 + 2 * x)] -
                            v.samples[static_cast<std::size_t>((z * 5 + y) * 5 + x)]) <= rounding({4, 4, 4}));
}

BOOST_AUTO_TEST_CASE(cells_for_samples_come_as_near_as_proportions_allow) {
  BOOST_TEST((cells_for_samples({64, 64, 64}, 65.0 * 65 * 65) == Index3{64, 64, 64}));
  BOOST_TEST((cells_for_samples({64, 64, 64}, 129.0 * 129 * 129) == Index3{128, 128, 128}));
  const Index3 c = cells_for_samples({128, 128, 256}, 1e7);
  BOOST_TEST(std::abs(c[2] - 2 * c[0]) <= 1);  // each axis is rounded by itself
}

BOOST_AUTO_TEST_CASE(a_wave_of_the_mirror_extension_has_one_coefficient) {
  for (const Index3& cells : {Index3{23, 9, 0}, Index3{4, 69, 2}, Index3{16, 8, 32}})
    for (const Index3& m : {Index3{0, 0, 0}, Index3{3, 2, 0}, Index3{4, 8, 0}}) {
      const Volume v = wave_volume(cells, m);
      const Index3 n = v.grid.samples();
      const auto spectrum = cosine_spectrum(v.samples, n);
      const std::int64_t one = (m[2] * n[1] + m[1]) * n[0] + m[0];
      double worst = 0;
      for (std::int64_t i = 0; i < v.grid.sample_count(); ++i)
        worst = std::max(worst, std::abs(static_cast<double>(spectrum[static_cast<std::size_t>(i)]) -
                                         (i == one ? 1.0 : 0.0)));
      // Rows of the matrix sum to 2 at most: what is rounded grows by as much an axis.
      BOOST_TEST(worst <= tolerance::fp32_sum(4, 8));
    }
}

BOOST_AUTO_TEST_CASE(sizes_that_mean_nothing_are_refused) {
  const Volume v = wave_volume({4, 4, 4}, {0, 0, 0});
  BOOST_CHECK_THROW(upsample_volume(v, {0, 4, 4}), InputError);
  Volume broken = v;
  broken.samples.pop_back();
  BOOST_CHECK_THROW(upsample_volume(broken, {8, 8, 8}), InputError);
}
