#include "host/certify/gold/cell_test.hpp"

#include <algorithm>
#include <bit>
#include <string>

#include "host/base/opencl/work_groups.hpp"
#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"

namespace vdvr {

static_assert(sizeof(VdvrCellTest) == 32);

namespace {

std::vector<float> floats(const opencl::DeviceArray<cl_int>& bits) {
  std::vector<float> out;
  for (const cl_int b : bits.to_host()) out.push_back(b < 0 ? -1.0f : std::bit_cast<float>(b));
  return out;
}

std::vector<cl_int> numbers(std::span<const CellBox> boxes) {
  std::vector<cl_int> out;
  for (const CellBox& box : boxes) {
    out.insert(out.end(), box.first.begin(), box.first.end());
    out.insert(out.end(), box.end.begin(), box.end.end());
  }
  return out;
}

std::vector<CellBox> boxes_of(const std::vector<cl_int>& numbers) {
  std::vector<CellBox> out(numbers.size() / 6);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    CellBox& box = out[i / 6];
    (i % 6 < 3 ? box.first : box.end)[i % 3] = static_cast<std::int16_t>(numbers[i]);
  }
  return out;
}

}  // namespace

CellTestResults cell_test(opencl::State& state, const DeviceField& field, const GoldOnDevice& gold,
                          const VdvrCellTest& test, const opencl::DeviceArray<std::uint8_t>& selected,
                          std::span<const CellBox> boxes, std::int64_t brick_nodes) {
  const VdvrGoldShape& s = gold.shape;
  const std::uint64_t across = count(std::int64_t{s.bricks_x} * s.bricks_y),
                      layers = count(std::int64_t{s.bricks_z} * s.blocks);
  opencl::DeviceArray<cl_int> total(state, across * layers, "brick totals"),
      error(state, across * layers, "brick errors"), slack(state, across * layers, "brick slack"),
      passed(state, across * layers, "totals of passing cells"),
      violated(state, across * layers, "violations");
  for (auto* result : {&total, &error, &slack, &passed}) result->fill(-1);
  violated.fill(0);
  const CellBox none{{INT16_MAX, INT16_MAX, INT16_MAX}, {-1, -1, -1}};
  const auto open = opencl::copied<cl_int>(state, numbers(std::vector(boxes.size(), none)), "failing cells"),
             wanted = opencl::copied<cl_int>(state, numbers(boxes), "cells to test");
  opencl::Defines defines = field.defines;
  // Eight at most: the corners' parts are as many registers. On a GPU a row of a brick is cut into pieces for
  // the same reason.
  const std::int64_t lanes = opencl::lanes_of(state.info, to_int(std::min<std::int64_t>(8, brick_nodes))),
                     cells_x = lanes == 1 ? std::min<std::int64_t>(4, brick_nodes) : brick_nodes;
  defines.emplace_back("VDVR_LANES", std::to_string(lanes));
  defines.emplace_back("VDVR_CELLS_X", std::to_string(cells_x));
  defines.emplace_back("VDVR_BRICK_NODES", std::to_string(brick_nodes));
  defines.emplace_back("VDVR_WINDOWED", test.windowed != 0 ? "1" : "0");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                 cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                 cl::Buffer, VdvrGoldShape, VdvrCellTest>
      kernel(state, "certify/gold/cell_test", "cell_test", defines);
  const std::uint64_t heights = count((brick_nodes + lanes - 1) / lanes),
                      rows = across * count((brick_nodes + cells_x - 1) / cells_x);
  kernel(opencl::in_groups(state.info, {heights, rows, layers}), total.buffer(), error.buffer(),
         slack.buffer(), passed.buffer(), open.buffer(), violated.buffer(), wanted.buffer(),
         field.samples.buffer(), field.bricks.buffer(), field.grid, gold.gold.buffer(), gold.addend.buffer(),
         gold.tolerances.buffer(), gold.margin.buffer(), gold.first_brick.buffer(), selected.buffer(), s,
         test);
  CellTestResults out{
      floats(total), floats(error), floats(slack), floats(passed), boxes_of(open.to_host()), {}};
  out.violated.assign(out.total.size(), 0);
  if (test.parts == 0) return out;
  const auto bits = violated.to_host();
  for (std::size_t i = 0; i < bits.size(); ++i) out.violated[i] = static_cast<std::uint32_t>(bits[i]);
  return out;
}

}  // namespace vdvr
