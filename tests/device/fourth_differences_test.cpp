// Largest fourth differences by brick to the bit of the host's, with the lanes and the groups of every
// device: what work-items share must be their own group's, on as many threads as there are.
#define BOOST_TEST_MODULE fourth_differences
#include "shared/fourth_differences.h"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "host/base/opencl/kernel.hpp"
#include "host/base/opencl/work_groups.hpp"
#include "vdvr/device.hpp"

namespace vdvr {
namespace {

constexpr VdvrFourthDifferences shape{.bricks_x = 9,
                                      .bricks_y = 8,
                                      .bricks_z = 5,
                                      .side_x = 4,
                                      .side_y = 3,
                                      .side_z = 10,
                                      .nx = 9 * 4 + 5,
                                      .stride = 64,
                                      .first_z = 1,
                                      .last_z = 47,
                                      .lowest = -0.5f};
constexpr int ny = shape.bricks_y * shape.side_y + 5;

struct Inputs {
  std::vector<float> gold, margin;
};
Inputs random_inputs() {
  std::mt19937 random(7);
  std::normal_distribution<float> value(0, 1);
  std::uniform_real_distribution<float> margin(-0.6f, 1);
  Inputs in;
  // A run of lanes may begin at a column's last node.
  in.gold.resize(std::size_t{ny} * shape.nx * shape.stride + 16);
  in.margin.resize(std::size_t{ny} * shape.nx);
  for (float& v : in.gold) v = value(random);
  for (float& v : in.margin) v = margin(random);
  in.gold[in.gold.size() / 3] = std::numeric_limits<float>::quiet_NaN();
  return in;
}

using Six = std::array<float, 6>;

// In the kernel's order.
Six differences_at(const float* c) {
  constexpr std::ptrdiff_t to_x = shape.stride, to_y = std::ptrdiff_t{shape.nx} * shape.stride;
  const auto fourth = [&](std::ptrdiff_t step) {
    return std::fma(6.0f, *c, std::fma(-4.0f, c[-step] + c[step], c[-2 * step] + c[2 * step]));
  };
  const auto along = [](const float* p) { return std::fma(-2.0f, *p, p[-1] + p[1]); };
  const float sides = c[-to_x] + c[to_x] + c[-to_y] + c[to_y],
              corners = c[-to_x - to_y] + c[to_x - to_y] + c[-to_x + to_y] + c[to_x + to_y], here = along(c);
  return {fourth(to_x),
          fourth(to_y),
          fourth(1),
          std::fma(4.0f, *c, std::fma(-2.0f, sides, corners)),
          std::fma(-2.0f, here, along(c - to_x) + along(c + to_x)),
          std::fma(-2.0f, here, along(c - to_y) + along(c + to_y))};
}

std::vector<float> on_the_host(const Inputs& in) {
  std::vector<float> out;
  for (int bz = 0; bz < shape.bricks_z; ++bz)
    for (int by = 0; by < shape.bricks_y; ++by)
      for (int bx = 0; bx < shape.bricks_x; ++bx) {
        Six largest{};
        for (int y = by * shape.side_y; y <= (by + 1) * shape.side_y; ++y)
          for (int x = bx * shape.side_x; x <= (bx + 1) * shape.side_x; ++x) {
            const std::size_t column = static_cast<std::size_t>((y + 2) * shape.nx + x + 2);
            if (in.margin[column] < shape.lowest) continue;
            for (int z = bz * shape.side_z; z <= (bz + 1) * shape.side_z; ++z) {
              if (z < shape.first_z || z > shape.last_z) continue;
              const Six d = differences_at(&in.gold[column * shape.stride + static_cast<std::size_t>(z) + 2]);
              for (std::size_t i = 0; i < 6; ++i) {
                const float size = std::abs(d[i]);
                largest[i] = std::max(largest[i], size <= std::numeric_limits<float>::max()
                                                      ? size
                                                      : std::numeric_limits<float>::infinity());
              }
            }
          }
        out.insert(out.end(), largest.begin(), largest.end());
      }
  return out;
}

BOOST_AUTO_TEST_CASE(bricks_have_the_hosts_whatever_shares_them) {
  const Inputs in = random_inputs();
  const std::vector<float> expected = on_the_host(in);
  BOOST_TEST(std::count(expected.begin(), expected.end(), 0.0f) == 0);
  BOOST_TEST(std::count(expected.begin(), expected.end(), std::numeric_limits<float>::infinity()) > 0);
  Device device;
  opencl::State& state = device.state();
  const opencl::DeviceArray<float> gold(state, std::span<const float>(in.gold), "gold"),
      margin(state, std::span<const float>(in.margin), "margins");
  opencl::DeviceArray<float> out(state, expected.size(), "differences");
  for (const int lanes : {1, 4, 8})
    for (const std::uint64_t along : {1u, 2u, 32u}) {
      opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrFourthDifferences, cl::LocalSpaceArg> kernel(
          state, "certify/kept/fourth_differences", "fourth_differences",
          {{"VDVR_LANES", std::to_string(lanes)}, {"VDVR_ALONG", std::to_string(along)}});
      // Groups of a few threads meet seldom.
      for (int round = 0; round < (along > 1 ? 20 : 1); ++round) {
        out.fill(-1);
        kernel({{along * shape.bricks_x, shape.bricks_y, shape.bricks_z}, {along, 1, 1}}, out.buffer(),
               gold.buffer(), margin.buffer(), shape, cl::Local(along * sizeof(cl_int)));
        const std::vector<float> found = out.to_host();
        BOOST_TEST((found == expected), lanes << " lanes, " << along << " work-items, round " << round);
        if (found != expected) break;
      }
    }
}

}  // namespace
}  // namespace vdvr
