// That a*b+c of the definition of the field stays a product and a sum in the library, on processors that
// could do both at once: CMake compiles host/volume/mixed_volume.cpp for this test as for the library, with
// the library target's own options, but optimised and for such a processor.
#define BOOST_TEST_MODULE contraction
#include <boost/test/unit_test.hpp>

#include <array>
#include <cstring>
#include <iostream>
#include <random>

#include "vdvr/expert/mixed_volume.hpp"

using namespace vdvr;

namespace {

constexpr std::int64_t kCells = 7;

bool processor_contracts() {
#if defined(__x86_64__) || defined(__i386__)
  return __builtin_cpu_supports("fma") != 0;
#else
  return true;  // with the compiler's default, where it has no other instructions for it
#endif
}

Volume random_volume() {
  Volume volume{{{kCells, kCells, kCells}, {0, 0, 0}, {1, 1, 1}, "pixel"}, {}};
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  for (std::int64_t i = 0; i < volume.grid.sample_count(); ++i) volume.samples.push_back(value(random));
  return volume;
}

// Each product is a float before it is added: `volatile` leaves no choice.
float rounded_lerp(float a, float b, float t) {
  const volatile float rest = 1.0f - t;
  const volatile float first = rest * a, second = t * b;
  return first + second;
}

// x first, then y, then z, as docs/file-format.md has it.
float rounded_sample(const Volume& v, const Index3& cell, const std::array<float, 3>& t) {
  const auto at = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    const std::int64_t n = kCells + 1;
    return v.samples[static_cast<std::size_t>(((cell[2] + z) * n + cell[1] + y) * n + cell[0] + x)];
  };
  const auto plane = [&](std::int64_t z) {
    return rounded_lerp(rounded_lerp(at(0, 0, z), at(1, 0, z), t[0]),
                        rounded_lerp(at(0, 1, z), at(1, 1, z), t[0]), t[1]);
  };
  return rounded_lerp(plane(0), plane(1), t[2]);
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_library_never_contracts) {
  if (!processor_contracts()) {
    std::cout << "contraction_test skipped: this processor has no FMA\n";
    return;
  }
  const Volume volume = random_volume();
  const MixedVolume mixed = as_mixed(volume);
  std::mt19937 random(2);
  std::uniform_int_distribution<int> cell(0, kCells - 1), fraction(0, (1 << 20) - 1);
  int different = 0;
  for (int i = 0; i < 10000; ++i) {
    Index3 at{};
    std::array<float, 3> t{};
    Vec3 point{};
    for (std::size_t a = 0; a < 3; ++a) {
      at[a] = cell(random);
      // 20 bits, and 3 before the point: exact in fp32.
      t[a] = static_cast<float>(fraction(random)) * 0x1p-20f;
      point[a] = static_cast<double>(at[a]) + static_cast<double>(t[a]);
    }
    const float sampled = sample_at(mixed, point), expected = rounded_sample(volume, at, t);
    different += std::memcmp(&sampled, &expected, sizeof sampled) != 0;
  }
  BOOST_TEST(different == 0, different << " of 10000 samples were contracted");
}
