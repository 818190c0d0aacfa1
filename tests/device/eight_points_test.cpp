// Weights of Lagrange on a device err together by as much as verify charges, and by more than a tenth of it.
#define BOOST_TEST_MODULE eight_points
#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "host/base/opencl/array.hpp"
#include "host/base/opencl/embedded.hpp"
#include "host/base/opencl/state.hpp"
#include "tests/support/device.hpp"
#include "tests/support/places.hpp"

using namespace vdvr;

namespace {

cl::Program build_weights(opencl::State& state) {
  std::ifstream file(std::string(vdvr::support::source_dir) + "/tests/device/eight_points.cl");
  std::ostringstream text;
  text << file.rdbuf();
  cl::Program program(state.context, opencl::resolve_source("device/eight_points.h") + text.str());
  program.build({state.device}, opencl::build_options({}).c_str());
  return program;
}

// On the nodes -3 .. 4.
double weight(double at, int n) {
  double product = 1;
  for (int m = -3; m <= 4; ++m)
    if (m != n) product *= (at - m) / (n - m);
  return product;
}

}  // namespace

BOOST_AUTO_TEST_CASE(eight_weights_are_lagranges) {
  opencl::State& state = support::device().state();
  constexpr int items = 4096;
  std::vector<float> places;
  for (int i = 0; i < items; ++i)
    places.push_back(static_cast<float>(i) / items + 0x1p-20f * static_cast<float>(i % 7));
  const opencl::DeviceArray<float> on_device(state, std::span<const float>(places), "places");
  opencl::DeviceArray<float> weights(state, 2 * 8 * places.size(), "weights");
  cl::KernelFunctor<cl::Buffer, cl::Buffer, int> weigh(build_weights(state), "weigh");
  weigh(cl::EnqueueArgs(state.queue, cl::NDRange(items)), on_device.buffer(), weights.buffer(), items);
  std::vector<float> found = weights.to_host();
  const auto of_four = found.begin() + 8 * items;
  BOOST_TEST(std::equal(found.begin(), of_four, of_four));  // to the bit
  double worst = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    double errors = 0;
    for (int n = 0; n < 8; ++n)
      errors += std::abs(static_cast<double>(found[8 * i + static_cast<std::size_t>(n)]) -
                         weight(static_cast<double>(places[i]), n - 3));
    worst = std::max(worst, errors);
  }
  BOOST_TEST_MESSAGE(worst * 0x1p24 << " roundings");
  // The place itself rounds by a quarter of one where the middle is taken off; slopes add up to 2.7.
  BOOST_TEST(worst <= (8.3 + 0.25 * 2.7) * 0x1p-24);
  BOOST_TEST(worst > 0.83 * 0x1p-24);
}

BOOST_AUTO_TEST_CASE(weights_of_rows_are_lagranges_half_a_place_beyond) {
  opencl::State& state = support::device().state();
  constexpr int items = 4096;
  std::vector<float> places;  // from the middle
  for (int i = 0; i < items; ++i) places.push_back(2 * static_cast<float>(i) / (items - 1) - 1);
  const opencl::DeviceArray<float> on_device(state, std::span<const float>(places), "places");
  const opencl::DeviceArray<float> weights(state, 8 * places.size(), "weights");
  cl::KernelFunctor<cl::Buffer, cl::Buffer, int> weigh(build_weights(state), "weigh_rows");
  weigh(cl::EnqueueArgs(state.queue, cl::NDRange(items / 8)), on_device.buffer(), weights.buffer(), items);
  const std::vector<float> found = weights.to_host();
  double worst = 0, sum = 0, product = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    double errors = 0, magnitudes = 0, distances = 1;
    const double at = 0.5 + static_cast<double>(places[i]);
    for (int n = 0; n < 8; ++n) {
      const double exact = weight(at, n - 3);
      errors += std::abs(static_cast<double>(found[static_cast<std::size_t>(n) * items + i]) - exact);
      magnitudes += std::abs(exact);
      distances *= std::abs(at - (n - 3));
    }
    worst = std::max(worst, errors);
    sum = std::max(sum, magnitudes);
    product = std::max(product, distances);
  }
  BOOST_TEST_MESSAGE(worst * 0x1p24 << " roundings");
  BOOST_TEST(worst <= 22.9 * 0x1p-24);
  BOOST_TEST(worst > 2.29 * 0x1p-24);
  // As cone_bounds.cpp has them.
  BOOST_TEST(sum <= 1.6592);
  BOOST_TEST(sum > 1.659);
  BOOST_TEST(product <= 55.37109375);
  BOOST_TEST(product > 55.37);
}
