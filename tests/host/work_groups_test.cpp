// How kernels that carry heights are launched, by device class.
#define BOOST_TEST_MODULE work_groups
#include "host/base/opencl/work_groups.hpp"

#include <boost/test/unit_test.hpp>

namespace vdvr {
namespace {

DeviceInfo of_class(bool gpu) {
  DeviceInfo d;
  d.is_gpu = gpu;
  d.is_cpu = !gpu;
  return d;
}

using Sizes = std::array<std::uint64_t, 3>;

BOOST_AUTO_TEST_CASE(groups_of_a_gpu_lie_along_the_axis_of_memory) {
  const DeviceInfo gpu = of_class(true);
  for (const Sizes& global : {Sizes{33, 40, 7}, {32, 1, 500}, {5, 300, 2}, {1, 1, 1}, {700, 3, 3}})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Sizes local = opencl::in_groups(gpu, global, {1, 4, 1}, axis).local;
      BOOST_TEST(local[axis] >= std::min<std::uint64_t>(32, global[axis]));
      // 64 work-items, but where the ranges have fewer; no axis is rounded up to more than twice its range.
      std::uint64_t items = 1, most = 1;
      for (std::size_t a = 0; a < 3; ++a) {
        items *= local[a];
        most = std::min<std::uint64_t>(64, most * global[a]);
        BOOST_TEST(local[a] < 2 * global[a]);
      }
      BOOST_TEST(items <= 64);
      BOOST_TEST(items >= std::min<std::uint64_t>(32, most));
    }
}

BOOST_AUTO_TEST_CASE(groups_of_a_cpu_are_the_launchers_own) {
  const opencl::Range range = opencl::in_groups(of_class(false), {33, 40, 7}, {1, 4, 1});
  BOOST_TEST((range.local == Sizes{1, 4, 1}));
  BOOST_TEST((range.global == Sizes{33, 40, 7}));
  BOOST_TEST((opencl::shared_groups(of_class(false), {1, 5, 6}).local == Sizes{1, 1, 1}));
}

BOOST_AUTO_TEST_CASE(lanes_are_those_that_kernels_are_written_for) {
  for (const bool gpu : {false, true})
    for (int most = 1; most <= 40; ++most) {
      const int lanes = opencl::lanes_of(of_class(gpu), most);
      BOOST_TEST((lanes == 1 || lanes == 4 || lanes == 8 || lanes == 16));
      BOOST_TEST(lanes <= most);
    }
  // Half of four, as sums in double precision would have it.
  BOOST_TEST(opencl::lanes_of(of_class(false), 2) == 1);
}

}  // namespace
}  // namespace vdvr
