// D2VR: holds the filtered projections on the device, finds where they leave space empty, launches the
// ray-caster over them. Launches: raycast_dvr, d2vr_points of kernels/picture/render/d2vr.cl.
#include "host/picture/render/d2vr.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/opencl/kernel.hpp"
#include "host/base/system/casts.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "host/picture/render/check_render_options.hpp"
#include "host/picture/render/raycast_params.hpp"
#include "host/volume/bricks.hpp"
#include "host/volume/sampler/resident_volume.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrDetector) == 32);

namespace {

using opencl::DeviceArray;
using Projections = D2vrField::Impl;

constexpr int kGranularity = 4;
// Columns and rows are found in fp32: a point on the detector's edge stays covered whatever the rounding. At
// 16384 stored columns three roundings err by less than this.
constexpr double kEdge = 0x1p-8;

void check_options(const ParallelGeometry& g, const D2vrOptions& options) {
  const int n = options.upsampling;
  if (n < 1 || n > 64 || (n & (n - 1)) != 0)
    throw InputError(fmt::format("`upsampling` {} must be a power of two, 1 to 64", n));
  if (g.columns < 2)
    throw InputError(fmt::format("a detector of {} columns has nothing to interpolate between", g.columns));
  // Kernels address one view by 32 bits.
  const double most = std::numeric_limits<std::int32_t>::max();
  if (!(static_cast<double>(n * g.columns + 16) * static_cast<double>(n * g.rows + 1) < most))
    throw InputError(
        fmt::format("{} columns and {} rows upsampled {} times pass 2^31 samples a view; lower `upsampling`",
                    g.columns, g.rows, n));
}

// A detector of one row has no second one to blend with: it stands twice.
std::vector<float> two_rows(std::span<const float> one) {
  std::vector<float> both;
  both.reserve(2 * one.size());
  for (const float q : one) both.insert(both.end(), 2, q);
  return both;
}

void store_as_filtered(Projections& p, const FilteredScan& filtered) {
  p.columns = filtered.geometry.columns;
  p.rows = std::max<std::int64_t>(2, filtered.geometry.rows);
  const bool single = filtered.geometry.rows == 1;
  p.samples = DeviceArray<float>(
      *p.state, static_cast<std::uint64_t>(p.geometry.views() * p.columns * p.rows), "filtered projections");
  if (single) p.samples.write(two_rows(filtered.samples));
  else p.samples.write(filtered.samples);
}

// Slabs are [row / 16][view][column][16]; kernels here want [view][column][row].
void store_slab(Projections& p, const UpsampledSlab& slab) {
  std::vector<float> out(at(slab.views * p.columns * p.rows));
  slab.values.read_mapped([&](std::span<const float> values) {
    for (std::int64_t i = 0; i < slab.views * p.columns; ++i)
      for (std::int64_t row = 0; row < p.rows; ++row) {
        const std::int64_t from = std::min(row, slab.rows - 1);
        out[at(i * p.rows + row)] = values[at((from / 16 * slab.views * p.columns + i) * 16 + from % 16)];
      }
  });
  p.samples.write(out, static_cast<std::uint64_t>(slab.first_view * p.columns * p.rows));
}

void store_upsampled(Projections& p, const FilteredScan& filtered, const Progress& progress) {
  const ParallelGeometry& g = filtered.geometry;
  const UpsampledColumns columns = upsampled_columns(g.columns, p.rate, 0);
  std::vector<double> rows(at((g.rows - 1) * p.rate + 1));
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<double>(i) / p.rate;
  p.first_column = columns.position(0);
  p.columns = columns.count;
  p.rows = std::max<std::int64_t>(2, static_cast<std::int64_t>(rows.size()));
  p.samples = DeviceArray<float>(*p.state, static_cast<std::uint64_t>(g.views() * p.columns * p.rows),
                                 fmt::format("filtered projections, upsampled {} times", p.rate));
  Upsampler upsampler(*p.state, filtered);
  // Groups of views of about 32 MiB: the rearranged copy stays small.
  const std::int64_t group =
      std::clamp<std::int64_t>((std::int64_t{8} << 20) / (p.columns * p.rows), 1, g.views());
  for (std::int64_t first = 0; first < g.views(); first += group) {
    report(progress, "upsample", static_cast<double>(first) / static_cast<double>(g.views()));
    store_slab(p, upsampler(columns, rows, 0, 0, p.rate, first, std::min(group, g.views() - first)));
  }
}

}  // namespace

// --- the field ---

VdvrDetector Projections::detector(const Grid& grid) const {
  const ParallelGeometry& g = geometry;
  const double edge = kEdge, n = rate;
  VdvrDetector d{};
  d.views = static_cast<int>(g.views());
  d.columns = static_cast<int>(columns);
  d.rows = static_cast<int>(rows);
  const double row = grid.origin[2] / g.pitch_v + 0.5 * static_cast<double>(g.rows - 1);
  d.first_row = static_cast<float>(row * n);
  d.rows_per_cell = static_cast<float>(grid.spacing[2] / g.pitch_v * n);
  d.lowest_column = static_cast<float>((-0.5 - first_column) * n - edge);
  d.highest_column = static_cast<float>((static_cast<double>(g.columns) - 0.5 - first_column) * n + edge);
  return d;
}

std::vector<cl_float4> Projections::views(const Grid& grid) const {
  const ParallelGeometry& g = geometry;
  const double n = rate;
  std::vector<cl_float4> steps;
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
    const double theta = g.theta_rad[k];
    // In double precision up to here: what is left to round is the position in cells.
    const double c = std::cos(theta) / g.pitch_u, s = std::sin(theta) / g.pitch_u;
    const double first = grid.origin[0] * c + grid.origin[1] * s + g.center_of_view(k) - first_column;
    steps.push_back({{static_cast<float>(grid.spacing[0] * c * n),
                      static_cast<float>(grid.spacing[1] * s * n), static_cast<float>(first * n), 0.0f}});
  }
  return steps;
}

D2vrField::D2vrField(Device& device, const ProjectionSet& scan, const D2vrOptions& options,
                     const Progress& progress)
    : impl_(std::make_unique<Impl>()) {
  require_parallel(scan, "method d2vr");
  check_options(scan.geometry, options);
  impl_->state = &device.state();
  impl_->rate = options.upsampling;
  const FilteredScan filtered = filter_projections(*impl_->state, scan, options.field, progress);
  impl_->geometry = filtered.geometry;
  impl_->coverage.emplace(filtered.geometry);
  if (options.upsampling == 1) store_as_filtered(*impl_, filtered);
  else store_upsampled(*impl_, filtered, progress);
}
D2vrField::~D2vrField() = default;
D2vrField::D2vrField(D2vrField&&) noexcept = default;
D2vrField& D2vrField::operator=(D2vrField&&) noexcept = default;

const ParallelGeometry& D2vrField::geometry() const { return impl_->geometry; }
std::uint64_t D2vrField::bytes() const { return impl_->samples.size() * sizeof(float); }
bool D2vrField::covered(const Vec3& point) const {
  return impl_->coverage->margin(point[0], point[1]) >= 0 && impl_->coverage->margin_z(point[2]) >= 0;
}

namespace {

opencl::Defines defines_for(const char* kernel, const RenderOptions& o, const RaycastTuning& tuning,
                            int lanes) {
  return {{"VDVR_KERNEL", kernel},
          {"VDVR_GRANULARITY", std::to_string(kGranularity)},
          {"VDVR_GROUP_X", std::to_string(group_for(tuning.group_x, lanes))},
          {"VDVR_GROUP_Y", std::to_string(group_for(tuning.group_y, lanes))},
          {"VDVR_GEOMETRY", o.output == RenderOutput::colour ? "0" : "1"},
          {"VDVR_FIXED_LIGHTS", o.lights.empty() && o.head_light ? "0" : "1"},
          {"VDVR_D2VR_DERIVATIVE", o.gradient == GradientKind::analytic ? "1" : "0"},
          {"VDVR_LANES", std::to_string(lanes)}};
}

int lanes_for(const opencl::State& state, const RaycastTuning& tuning) {
  return tuning.lanes.value_or(state.info.is_cpu ? 8 : 1);
}

// Takes cell coordinates of a grid, group after group so that points take little memory and a user can stop.
class Evaluator {
 public:
  Evaluator(const Projections& p, const Grid& grid)
      : p_(p),
        detector_(p.detector(grid)),
        views_(*p.state, std::span<const cl_float4>(p.views(grid)), "views"),
        kernel_(*p.state, "picture/render/d2vr", "d2vr_points",
                defines_for("VDVR_KERNEL_POINTS", {}, {}, lanes_for(*p.state, {}))) {}

  // cell(i): the cell coordinate of point i.
  template <class Cell>
  std::vector<float> operator()(std::int64_t count, const Progress& progress, Cell&& cell) {
    constexpr std::int64_t group = 1 << 18;
    std::vector<float> values(at(count));
    std::vector<cl_float4> points(at(std::min(count, group)));
    if (count == 0) return values;
    DeviceArray<cl_float4> on_device(*p_.state, points.size(), "points");
    DeviceArray<float> out(*p_.state, points.size(), "values at points");
    const auto lanes = static_cast<std::uint64_t>(lanes_for(*p_.state, {}));
    for (std::int64_t first = 0; first < count; first += group) {
      report(progress, "sample projections", static_cast<double>(first) / static_cast<double>(count));
      const std::int64_t n = std::min(group, count - first);
      for (std::int64_t i = 0; i < n; ++i) {
        const Vec3 c = cell(first + i);
        points[at(i)] = {
            {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]), 0.0f}};
      }
      on_device.write(std::span<const cl_float4>(points).first(at(n)));
      const std::uint64_t items = (static_cast<std::uint64_t>(n) + lanes - 1) / lanes;
      kernel_({{items, 1, 1}, {64 / lanes, 1, 1}}, p_.samples.buffer(), detector_, views_.buffer(),
              on_device.buffer(), out.buffer(), static_cast<cl_int>(n));
      out.read(std::span<float>(values).subspan(at(first), at(n)));
    }
    return values;
  }

 private:
  const Projections& p_;
  VdvrDetector detector_;
  DeviceArray<cl_float4> views_;
  opencl::Kernel<cl::Buffer, VdvrDetector, cl::Buffer, cl::Buffer, cl::Buffer, cl_int> kernel_;
};

}  // namespace

std::vector<float> D2vrField::at(std::span<const Vec3> points, const Progress& progress) const {
  // Cells of a detector pixel around the axis: coordinates are then as small, hence as exact, as they can be.
  Grid grid;
  grid.spacing = {geometry().pitch_u, geometry().pitch_u, geometry().pitch_v};
  Evaluator evaluate(*impl_, grid);
  return evaluate(static_cast<std::int64_t>(points.size()), progress, [&](std::int64_t i) {
    const Vec3& p = points[vdvr::at(i)];
    return Vec3{p[0] / grid.spacing[0], p[1] / grid.spacing[1], p[2] / grid.spacing[2]};
  });
}

// --- the scene ---

std::vector<cl_float2> occupied_ranges(const Volume& v, int granularity) {
  const Index3 n = v.grid.samples();
  const Index3 bricks = Bricks(v.grid, granularity).along();
  std::vector<cl_float2> ranges;
  ranges.reserve(at(bricks[0] * bricks[1] * bricks[2]));
  for (std::int64_t bz = 0; bz < bricks[2]; ++bz)
    for (std::int64_t by = 0; by < bricks[1]; ++by)
      for (std::int64_t bx = 0; bx < bricks[0]; ++bx) {
        float lo = std::numeric_limits<float>::infinity(), hi = -lo;
        const auto first = [&](std::int64_t b) { return std::max<std::int64_t>(0, b * granularity - 1); };
        const auto last = [&](std::int64_t b, std::size_t a) {
          return std::min(n[a] - 1, (b + 1) * granularity + 1);
        };
        for (std::int64_t z = first(bz); z <= last(bz, 2); ++z)
          for (std::int64_t y = first(by); y <= last(by, 1); ++y) {
            const auto row = v.samples.begin() + (z * n[1] + y) * n[0];
            const auto [least, most] = std::minmax_element(row + first(bx), row + last(bx, 0) + 1);
            lo = std::min(lo, *least);
            hi = std::max(hi, *most);
          }
        const float margin = 0.5f * (hi - lo);
        ranges.push_back({{lo - margin, hi + margin}});
      }
  return ranges;
}

namespace {

VdvrGrid bricks_of(const Grid& grid) {
  MixedVolume v;
  v.grid = grid;
  v.granularity = kGranularity;
  return sampler_grid(v);
}

}  // namespace

struct D2vrScene::Impl {
  const D2vrField* field;
  Volume samples;
  std::vector<cl_float2> ranges;
  DrawnField drawn;
  DeviceArray<cl_float4> views;
};

D2vrScene::D2vrScene(Device& device, const D2vrField& field, const Grid& grid, const Progress& progress)
    : impl_(std::make_unique<Impl>()) {
  check_drawn_grid(grid);
  impl_->field = &field;
  const Index3 n = grid.samples();
  {
    Evaluator evaluate(field.impl(), grid);
    impl_->samples = {grid, evaluate(grid.sample_count(), progress, [&](std::int64_t i) {
                        return Vec3{static_cast<double>(i % n[0]), static_cast<double>(i / n[0] % n[1]),
                                    static_cast<double>(i / (n[0] * n[1]))};
                      })};
  }
  impl_->ranges = occupied_ranges(impl_->samples, kGranularity);
  const auto [lo, hi] = std::minmax_element(impl_->samples.samples.begin(), impl_->samples.samples.end());
  impl_->drawn = {&device.state(), grid, bricks_of(grid), impl_->ranges, {*lo, *hi}, 0, {}};
  const std::vector<cl_float4> views = field.impl().views(grid);
  impl_->views = DeviceArray<cl_float4>(device.state(), std::span<const cl_float4>(views), "views");
}
D2vrScene::~D2vrScene() = default;
D2vrScene::D2vrScene(D2vrScene&&) noexcept = default;
D2vrScene& D2vrScene::operator=(D2vrScene&&) noexcept = default;
const Volume& D2vrScene::samples() const { return impl_->samples; }
const D2vrField& D2vrScene::field() const { return *impl_->field; }
DrawnField drawn_field(const D2vrScene& scene) { return scene.impl().drawn; }

namespace {

void check_dvr(const RenderOptions& o) {
  const auto refuse = [](const char* what) {
    throw InputError(
        fmt::format("{}; D2VR, which has projections instead of a volume, draws `mode` dvr with "
                    "`classification` post and `step_mode` fixed: build the "
                    "volume first, or render with `method` vdvr or dvr",
                    what));
  };
  if (o.mode != RenderMode::dvr) refuse("`method` d2vr does not draw this `mode`");
  if (o.classification != Classification::post)
    refuse("`classification` preintegrated does not apply to `method` d2vr");
  if (o.step_mode == StepMode::level) refuse("`step_mode` level does not apply to `method` d2vr");
  if (o.gradient == GradientKind::stored)
    refuse("`gradient` stored does not apply to `method` d2vr, which has no stored samples");
  if (o.sampler == SamplerKind::image3d) refuse("`sampler` image3d does not apply to `method` d2vr");
  if (o.output == RenderOutput::error) refuse("`show` error: `method` d2vr has no certificate");
}

}  // namespace

Enqueued enqueue_frame(Frame& frame, const D2vrScene& scene, const RenderOptions& o,
                       const RaycastTuning& tuning) {
  check_dvr(o);
  check_options(o);
  const D2vrScene::Impl& s = scene.impl();
  const Projections& p = s.field->impl();
  const DrawnField& drawn = frame.field();
  const int lanes = lanes_for(*p.state, tuning);
  const BakedTransfer& table = frame.prepare(o, 0);
  opencl::Kernel<cl::Buffer, VdvrDetector, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrRaycast,
                 cl::Buffer, cl::Buffer>
      kernel(*p.state, "picture/render/d2vr", "raycast_dvr",
             defines_for("VDVR_KERNEL_DVR", o, tuning, lanes));
  opencl::finish(*p.state, "preparing a frame");
  const GradientKind gradient =
      o.gradient == GradientKind::analytic ? GradientKind::analytic : GradientKind::central;
  const Enqueued result{SamplerKind::buffer, "D2VR: projections, bilinear", gradient,
                        std::chrono::steady_clock::now()};
  kernel(packet_range(o, tuning, lanes), p.samples.buffer(), p.detector(drawn.grid), s.views.buffer(),
         drawn.bricks, frame.distance(), frame.table(), make_params(drawn, o, table, 0),
         frame.picture().buffer(), frame.row_samples());
  return result;
}

FloatPicture raycast_float(const D2vrScene& scene, const RenderOptions& o, const RaycastTuning& tuning) {
  Frame frame(drawn_field(scene));
  return read_frame(frame, enqueue_frame(frame, scene, o, tuning));
}

}  // namespace vdvr
