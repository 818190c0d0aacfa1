// Masks of one lane, which are 1 where those of vectors are -1, say the same as those of 4, 8 and 16.
#define BOOST_TEST_MODULE masks
#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "host/base/opencl/array.hpp"
#include "host/base/opencl/embedded.hpp"
#include "host/base/opencl/state.hpp"
#include "tests/support/device.hpp"
#include "tests/support/places.hpp"

using namespace vdvr;
using support::device;

namespace {

/// Every pattern of values above and below the limit of 0 in so many lanes; of 16, each with one lane apart.
std::vector<float> patterns(int lanes) {
  std::vector<float> values;
  const unsigned all = (1u << lanes) - 1;
  for (unsigned n = 0; n <= (lanes <= 8 ? all : 33u); ++n) {
    const unsigned pattern = lanes <= 8 ? n
                             : n < 16   ? 1u << n
                             : n < 32   ? all ^ 1u << (n - 16)
                             : n == 32  ? 0
                                        : all;
    for (int lane = 0; lane < lanes; ++lane) values.push_back((pattern >> lane & 1) != 0 ? 0.5f : -0.5f);
  }
  return values;
}

cl::Program build_questions(opencl::State& state, int lanes) {
  std::ifstream file(std::string(vdvr::support::source_dir) + "/tests/device/masks.cl");
  std::ostringstream text;
  text << file.rdbuf();
  cl::Program program(state.context, opencl::resolve_source("device/lanes.h") + text.str());
  program.build({state.device}, opencl::build_options({{"VDVR_LANES", std::to_string(lanes)}}).c_str());
  return program;
}

}  // namespace

BOOST_AUTO_TEST_CASE(masks_of_any_number_of_lanes_say_the_same) {
  opencl::State& state = device().state();
  for (const int lanes : {1, 4, 8, 16}) {
    const std::vector<float> values = patterns(lanes);
    const std::size_t width = static_cast<std::size_t>(lanes), items = values.size() / width;
    const opencl::DeviceArray<float> on_device(state, std::span<const float>(values), "values");
    opencl::DeviceArray<cl_int> said(state, 3 * items, "answers");
    opencl::DeviceArray<float> picked(state, values.size(), "picked");
    cl::KernelFunctor<cl::Buffer, float, cl::Buffer, cl::Buffer, int> ask(build_questions(state, lanes),
                                                                          "ask");
    ask(cl::EnqueueArgs(state.queue, cl::NDRange(items)), on_device.buffer(), 0.0f, said.buffer(),
        picked.buffer(), static_cast<int>(items));
    const std::vector<cl_int> answers = said.to_host();
    const std::vector<float> choices = picked.to_host();
    for (std::size_t i = 0; i < items; ++i) {
      const auto first = values.begin() + static_cast<std::ptrdiff_t>(i * width);
      const auto above = std::count(first, first + lanes, 0.5f);
      BOOST_TEST_CONTEXT(lanes << " lanes, " << above << " of them above") {
        BOOST_TEST((answers[3 * i] != 0) == (above > 0));
        BOOST_TEST((answers[3 * i + 1] != 0) == (above == lanes));
        BOOST_TEST((answers[3 * i + 2] != 0) == (above == 0));
        for (std::size_t lane = 0; lane < width; ++lane)
          BOOST_TEST(choices[i * width + lane] == (values[i * width + lane] > 0 ? 1.0f : 2.0f));
      }
    }
  }
}
