// Launcher of kernels/field/fdk/cone_points.cl.
#include "host/field/fdk/cone_points.hpp"

#include <algorithm>
#include <array>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/opencl/kernel.hpp"
#include "host/base/system/casts.hpp"
#include "host/field/fdk/cone_back_project.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "shared/cone_points.h"

namespace vdvr {

static_assert(sizeof(VdvrPointView) == 48);
static_assert(sizeof(VdvrConePoints) == 40);

namespace {

constexpr int to_a_pixel = 2, steps_of_taps = 256;
// Tables that stay in a cache while all points read them.
constexpr std::int64_t most_views_at_points = 8;
// Pixels beyond the detector that taps reach, and what covered points and rounding take.
constexpr std::int64_t beyond_by_taps = VDVR_POINT_TAPS / 2 / to_a_pixel + 2;

// [step][tap % 2][tap / 2], and a set after the last step.
std::vector<float> taps_by_parity() {
  std::vector<float> out;
  for (int step = 0; step <= steps_of_taps; ++step) {
    const std::vector<double> taps =
        taps_between_half_columns(static_cast<double>(step) / steps_of_taps, VDVR_POINT_TAPS);
    for (std::size_t parity = 0; parity < 2; ++parity)
      for (std::size_t t = parity; t < taps.size(); t += 2) out.push_back(static_cast<float>(taps[t]));
  }
  return out;
}

// Places from the middle of the table on, so that fp32 has digits left for their parts.
VdvrPointView view_of_points(const ViewMatrix& m, const ConeTable& table) {
  VdvrPointView out{};
  const double first_u = table.first_column + static_cast<double>(table.columns / 2) / to_a_pixel,
               first_v = table.first_row + static_cast<double>(table.rows / 2) / to_a_pixel;
  for (std::size_t a = 0; a < 4; ++a) {
    out.u[a] = static_cast<float>(to_a_pixel * (m[0][a] - first_u * m[2][a]));
    out.v[a] = static_cast<float>(to_a_pixel * (m[1][a] - first_v * m[2][a]));
    out.lambda[a] = static_cast<float>(m[2][a]);
  }
  return out;
}

std::int64_t views_at_points(const opencl::State& state, const ConeTables& tables, std::int64_t views) {
  const std::uint64_t share = std::min(state.memory.left() / 2, state.info.max_allocation);
  return std::clamp<std::int64_t>(static_cast<std::int64_t>(share / tables.bytes(1)), 1,
                                  std::min(views, most_views_at_points));
}

}  // namespace

std::vector<float> cone_at_points(opencl::State& state, const ScanInUnits& from, const FieldOptions& field,
                                  std::span<const Vec3> points, const Progress& progress) {
  if (points.empty()) return {};
  const FilteredScan filtered = filter_cone(state, from.scan, field, progress, Precision::fp32, from.units);
  HostMemory host(state);
  host.count(filtered.samples.resident_bytes(), "the filtered projections");
  const ParallelGeometry& g = filtered.geometry;
  ConeTables tables(state, filtered, to_a_pixel,
                    {beyond_by_taps, -beyond_by_taps, g.rows + beyond_by_taps, false});
  std::vector<cl_float4> places;
  for (const Vec3& p : points)
    places.push_back({{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), 1.0f}});
  const opencl::DeviceArray<cl_float4> on_device(state, std::span<const cl_float4>(places), "points");
  const std::vector<float> sets = taps_by_parity();
  const opencl::DeviceArray<float> taps(state, std::span<const float>(sets), "taps of points"),
      out(state, points.size(), "values at points");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrConePoints> kernel(
      state, "field/fdk/cone_points", "cone_points");
  const std::int64_t together = views_at_points(state, tables, g.views());
  for (std::int64_t first = 0; first < g.views(); first += together) {
    report(progress, "points", static_cast<double>(first) / static_cast<double>(g.views()));
    const std::int64_t views = std::min(together, g.views() - first);
    const ConeTable table = tables(first, views);
    std::vector<VdvrPointView> of_views;
    for (std::int64_t k = 0; k < views; ++k)
      of_views.push_back(view_of_points(filtered.views[at(first + k)], table));
    const opencl::DeviceArray<VdvrPointView> matrices(state, std::span<const VdvrPointView>(of_views),
                                                      "views of points");
    const VdvrConePoints shape{.points = to_int(std::ssize(points)),
                               .views = to_int(views),
                               .columns = to_int(table.columns),
                               .rows = to_int(table.rows),
                               .row_stride = to_int(table.row_stride),
                               .middle_u = to_int(table.columns / 2),
                               .middle_v = to_int(table.rows / 2),
                               .steps = steps_of_taps,
                               .adds = first > 0 ? 1 : 0,
                               .reserved = 0};
    kernel({{points.size(), 1, 1}, {16, 1, 1}}, out.buffer(), table.values.buffer(), matrices.buffer(),
           on_device.buffer(), taps.buffer(), shape);
    opencl::finish(state, "points");  // before the table goes
  }
  return out.to_host();
}

}  // namespace vdvr
