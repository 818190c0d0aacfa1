// Launches kernels/pixel/pixel_bounds.cl: certify_picture, certify_fast. Called by the render and verify
// commands, and tests.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

#include "host/pixel/range_table.hpp"
#include "host/render/bake.hpp"
#include "host/render/check_render_options.hpp"
#include "host/render/glm_vectors.hpp"
#include "host/render/raycast.hpp"
#include "host/render/raycast_params.hpp"
#include "shared/certify_params.h"
#include "vdvr/certify_picture.hpp"
#include "vdvr/error.hpp"
#include "vdvr/stop.hpp"

namespace vdvr {
namespace {

using opencl::DeviceArray;
using Impl = ResidentVolume::Impl;

static_assert(sizeof(VdvrCertify) == 112);

constexpr double kUnit = 0x1p-24;
// Of the list of pieces; what a picture needs beyond is made by bands of fewer rows.
constexpr std::uint64_t kListBytes = std::uint64_t{192} << 20;
// Of a launch: between two of them a stop is heard.
constexpr int kBandRows = 64;

void check(const Impl& v, const std::vector<float>& bounds, const RenderOptions& o,
           const CertifyPictureOptions& c) {
  check_options(o);
  if (o.mode != RenderMode::dvr || o.output != RenderOutput::colour)
    throw InputError("only colours of `mode` dvr are certified pixel by pixel");
  if (o.shading && o.gradient == GradientKind::stored)
    throw InputError(
        "`gradient` stored: certified pictures take central or analytic, which need no other field");
  if (bounds.size() != v.host_ranges.size())
    throw InputError(fmt::format("{} bounds for {} bricks", bounds.size(), v.host_ranges.size()));
  if (!(c.kappa >= 0x1p-10 && c.kappa <= 1024))
    throw InputError(fmt::format("`certify_parts` kappa {} must lie between 1/1024 and 1024", c.kappa));
  if (!(c.theta > 0 && c.theta < 1))
    throw InputError(fmt::format("termination {} of a certified picture must lie in (0, 1)", c.theta));
  if (c.window && !is_clear_outside(o.transfer, *c.window))
    throw InputError(
        fmt::format("the transfer function shows values outside the certificate's window, {:.6g} to {:.6g}, "
                    "where F is unknown: take one whose opacity is 0 below and above it",
                    c.window->first, c.window->second));
}

/// The middle of the bounds that are finite: bins need not suit the least.
double typical_bound(std::vector<float> bounds) {
  bounds.erase(std::remove_if(bounds.begin(), bounds.end(), [](float e) { return !std::isfinite(e); }),
               bounds.end());
  if (bounds.empty()) return 0;
  const auto middle = bounds.begin() + static_cast<std::ptrdiff_t>(bounds.size() / 2);
  std::nth_element(bounds.begin(), middle, bounds.end());
  return static_cast<double>(*middle);
}

VdvrCertify make_certify(const Impl& v, const RenderOptions& o, const CertifyPictureOptions& c,
                         const RangeTable& table, double theta) {
  VdvrCertify q{};
  q.range_lo = table.lo;
  q.range_scale = table.scale;
  q.bins = table.bins;
  q.parts_per_spread = static_cast<float>(3 / (2 * c.kappa));
  q.deep = static_cast<float>(std::log2(1 / theta));
  q.theta = static_cast<float>(theta);
  // docs/pixel-bounds.md, theorem 6: corners 7.5 u M, averages 3 u M, coefficients of a part 2 u M, and what
  // they are widened by is a sum.
  q.slack = static_cast<float>(18 * kUnit * static_cast<double>(v.facts->largest));
  // Entry and product: 4 u of the cells of an axis.
  q.reach[0] = static_cast<float>(4 * kUnit * v.field.grid.cells_x);
  q.reach[1] = static_cast<float>(4 * kUnit * v.field.grid.cells_y);
  q.reach[2] = static_cast<float>(4 * kUnit * v.field.grid.cells_z);
  double most = 1;
  for (std::size_t k = 0; k < 3; ++k) most = std::max({most, o.background_top[k], o.background_bottom[k]});
  const double lights = std::max<double>(1, static_cast<double>(o.lights.size()) + (o.head_light ? 1 : 0));
  for (std::size_t k = 0; k < 3; ++k) {
    const bool any = table.colour_lo[k] <= table.colour_hi[k];
    double lo = any ? static_cast<double>(table.colour_lo[k]) : 1e30,
           hi = any ? static_cast<double>(table.colour_hi[k]) : -1e30;
    if (any && o.shading) {
      // Ambient light is a quarter; each light adds a highlight of a fifth at most.
      lo = std::min(lo, 0.25 * lo) - 0x1p-20;
      hi = std::max(hi, 0.25 * hi) + 0.2 * lights + 0x1p-20;
    }
    q.colour_lo[k] = static_cast<float>(lo);
    q.colour_hi[k] = static_cast<float>(hi);
    if (any) most = std::max({most, std::abs(lo), std::abs(hi)});
  }
  // Of theorem 6 too. The background is interpolated: 5 u of a quotient, and four roundings.
  q.first_error = static_cast<float>(10 * kUnit * most);
  q.sum_error = static_cast<float>(kUnit / 2 * std::exp2(std::ceil(std::log2(most))));
  q.share_error = static_cast<float>((c.fast ? VDVR_FAST_ROUNDING : VDVR_STEP_ROUNDING) * kUnit * most);
  q.joint_rounding = static_cast<float>(VDVR_JOINT_ROUNDING * kUnit * most);
  q.extinction_error = table.extinction_error;
  q.joint_error = 5 * static_cast<float>(most) * table.extinction_error;
  q.first_edge = table.first_edge;
  q.first_bend = table.first_bend;
  q.or_clear = c.window ? 1 : 0;
  return q;
}

/// By brick 1 where F can show nothing, whatever is done to V in fp32.
std::vector<std::uint8_t> clear_bricks(const Impl& v, const VdvrCertify& q, const RangeTable& table,
                                       const std::vector<float>& bounds, bool windowed) {
  const float reach = std::ldexp(q.reach[0] + q.reach[1] + q.reach[2], v.facts->highest_level);
  std::vector<std::uint8_t> clear(bounds.size());
  for (std::size_t i = 0; i < clear.size(); ++i) {
    const cl_float2 r = v.host_ranges[i];
    const float e = (bounds[i] + 2 * q.slack + 2 * reach * (r.s[1] - r.s[0])) * 1.00001f;
    clear[i] = table.is_clear(r.s[0] - e, r.s[1] + e) ? 1 : 0;
    // No cell of it was tested, so that F lies outside the window throughout.
    if (windowed && !std::isfinite(bounds[i])) clear[i] = 1;
  }
  return clear;
}

opencl::Defines with_kernel(opencl::Defines defines, const CertifyPictureOptions& c, bool light) {
  for (auto& [name, value] : defines)
    if (name == "VDVR_KERNEL") value = c.fast ? "VDVR_KERNEL_CERTIFY_FAST" : "VDVR_KERNEL_CERTIFY";
  defines.push_back({"VDVR_LIGHT", light ? "1" : "0"});
  defines.push_back({"VDVR_JOINT", c.box || c.fast ? "0" : "1"});
  return defines;
}

/// How far a ray of fp32 passes from the middle of its pixel, at the focal point's distance: 16 u of its
/// direction, and the rounding of the eye.
double ray_offset(const Grid& g, const RenderOptions& o) {
  const glm::dvec3 eye = to_glm(o.camera.position) - to_glm(g.origin);
  const double distance = glm::length(to_glm(o.camera.focal_point) - to_glm(o.camera.position));
  const double pixel =
      2 * std::tan(glm::radians(o.camera.view_angle_deg) / 2) / static_cast<double>(o.height);
  return (16 * kUnit + kUnit * glm::length(eye) / distance) / pixel;
}

class Launch {
 public:
  Launch(const Impl& v, const std::vector<float>& bounds, const RenderOptions& o,
         const CertifyPictureOptions& c)
      : v_(v),
        o_(o),
        certify_(c),
        table_(make_range_table(o.transfer, typical_bound(bounds), c.window.has_value())) {
    q_ = make_certify(v, o, c, table_, ending_share(c.theta, bounds, o.transfer));
    const VdvrGrid& grid = v.field.grid;
    const auto clear = clear_bricks(v, q_, table_, bounds, c.window.has_value());
    const auto distance = distance_to_other(clear, {grid.bricks_x, grid.bricks_y, grid.bricks_z});
    distance_ = DeviceArray<cl_uchar>(*v.state, distance, "distances to bricks that may show something");
    bounds_ = DeviceArray<float>(*v.state, bounds, "bounds of bricks");
    ranges_ = DeviceArray<cl_float4>(*v.state, table_.rows, "ranges of the transfer function");
    next_ = DeviceArray<cl_int>(*v.state, table_.next_shown, "bins that show something");
    const auto pixels = static_cast<std::uint64_t>(o.width * o.height);
    least_ = DeviceArray<cl_float4>(*v.state, pixels, "lower ends of pixels");
    most_ = DeviceArray<cl_float4>(*v.state, pixels, "upper ends of pixels");
    fullest_ = DeviceArray<cl_uint>(*v.state, 1, "longest list of pieces");
  }

  /// `field`: the sample buffer, or the three images of the atlas; `bricks` the records that go with it.
  template <class... Field>
  void run(SamplerKind sampler, const Progress& progress, const cl::Buffer& bricks, const Field&... field) {
    const int lanes = lanes_for(v_, sampler, GradientKind::central, {});
    const auto defines = with_kernel(
        raycast_defines(v_, o_, sampler,
                        o_.shading && o_.gradient == GradientKind::analytic ? GradientKind::analytic
                                                                            : GradientKind::central,
                        {}, lanes),
        certify_, o_.shading);
    const BakedTransfer baked = bake(o_.transfer, o_.step, 1);
    const DrawnField drawn{v_.state,
                           v_.grid,
                           v_.field.grid,
                           v_.host_ranges,
                           v_.facts->value_range,
                           v_.facts->highest_level,
                           v_.facts->has_tile};
    const VdvrRaycast p = make_params(drawn, o_, baked, q_.slack);
    const int height = static_cast<int>(o_.height);
    if (certify_.fast) {
      opencl::Kernel<Field..., cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                     VdvrRaycast, VdvrCertify, cl::Buffer, cl::Buffer>
          kernel(*v_.state, "pixel/pixel_bounds", "certify_fast", defines);
      for (q_.first_row = 0; q_.first_row < height; q_.first_row += q_.rows) {
        RenderOptions band = o_;
        band.height = q_.rows = std::min(height - q_.first_row, kBandRows);
        kernel(packet_range(band, {}, lanes), field..., bricks, v_.field.grid, distance_.buffer(),
               bounds_.buffer(), ranges_.buffer(), next_.buffer(), p, q_, least_.buffer(), most_.buffer());
        v_.state->queue.finish();
        band_is_done(progress, height);
      }
      return;
    }
    opencl::Kernel<Field..., cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                   VdvrRaycast, VdvrCertify, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer>
        kernel(*v_.state, "pixel/pixel_bounds", "certify_picture", defines);
    q_.capacity = 64;
    for (q_.first_row = 0; q_.first_row < height; q_.first_row += q_.rows) {
      opencl::Range range;
      const std::uint64_t longest = fit_list(lanes, range, height);
      fullest_.fill(0);
      kernel(range, field..., bricks, v_.field.grid, distance_.buffer(), bounds_.buffer(), ranges_.buffer(),
             next_.buffer(), p, q_, least_.buffer(), most_.buffer(), list_.buffer(), fullest_.buffer());
      std::uint64_t fullest = 0;
      for (const cl_uint pieces : fullest_.to_host()) fullest = std::max<std::uint64_t>(fullest, pieces);
      band_is_done(progress, height);
      if (fullest <= longest) continue;
      // Some lists were too short: the band once more.
      q_.capacity = static_cast<int>(fullest + fullest / 8);
      q_.first_row -= q_.rows;
    }
  }

  [[nodiscard]] std::vector<cl_float4> least() const { return least_.to_host(); }
  [[nodiscard]] std::vector<cl_float4> most() const { return most_.to_host(); }

 private:
  void band_is_done(const Progress& progress, int height) const {
    throw_if_stopped();
    report(progress, "certify", std::min(1.0, static_cast<double>(q_.first_row + q_.rows) / height));
  }
  /// Rows of the next band, and a list for it. Returns how many pieces a packet's list holds.
  std::uint64_t fit_list(int lanes, opencl::Range& range, int height) {
    RenderOptions band = o_;
    const auto packets = [&](int rows) {
      band.height = rows;
      range = packet_range(band, {}, lanes);
      return opencl::round_up(range.global[0], range.local[0]) *
             opencl::round_up(range.global[1], range.local[1]);
    };
    const std::uint64_t numbers = o_.shading ? VDVR_LIT_PIECE_NUMBERS : VDVR_PIECE_NUMBERS;
    const auto floats = [&](int rows) {
      return packets(rows) * static_cast<std::uint64_t>(lanes) * numbers *
             static_cast<std::uint64_t>(q_.capacity);
    };
    q_.rows = std::min(height - q_.first_row, kBandRows);
    while (q_.rows > 8 && floats(q_.rows) * sizeof(float) > kListBytes) q_.rows = std::max(8, q_.rows / 2);
    const std::uint64_t needed = floats(q_.rows);
    if (list_.size() < needed) {
      list_ = {};
      list_ = DeviceArray<float>(*v_.state, needed, "pieces of rays");
    }
    return static_cast<std::uint64_t>(q_.capacity);
  }

  const Impl& v_;
  const RenderOptions& o_;
  const CertifyPictureOptions& certify_;
  RangeTable table_;
  VdvrCertify q_{};
  DeviceArray<cl_uchar> distance_;
  DeviceArray<float> bounds_, list_;
  DeviceArray<cl_float4> ranges_, least_, most_;
  DeviceArray<cl_int> next_;
  DeviceArray<cl_uint> fullest_;
};

}  // namespace

double ending_share(double theta, const std::vector<float>& bounds, const TransferFunction& transfer) {
  const auto& points = transfer.points;
  const double range = points.empty() ? 0 : points.back().value - points.front().value,
               share = range > 0 ? typical_bound(bounds) / range / 16 : 1;
  return share > 0 ? std::min(theta, share) : theta;
}

bool is_clear_outside(const TransferFunction& transfer, const std::pair<double, double>& window) {
  const auto& points = transfer.points;
  if (points.empty()) return true;
  // Of a straight stretch a part lies outside: both its ends are then clear, or what lies between shows.
  const auto outside = [&](const TransferPoint& a, const TransferPoint& b) {
    return b.value > a.value && (a.value < window.first || b.value > window.second);
  };
  const auto shows = [](const TransferPoint& p) { return p.opacity > 0; };
  if (shows(points.front()) || shows(points.back())) return false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if ((points[i].value < window.first || points[i].value > window.second) && shows(points[i])) return false;
    if (i > 0 && outside(points[i - 1], points[i]) && (shows(points[i - 1]) || shows(points[i])))
      return false;
  }
  return true;
}

const char* text_of(CertifiedLight light) {
  return light == CertifiedLight::unlit ? "unlit" : light == CertifiedLight::lit ? "lit" : "as drawn";
}

PixelBounds certify_pixels(Device& device, const ResidentVolume& volume, const std::vector<float>& bounds,
                           const RenderOptions& options, const CertifyPictureOptions& certify,
                           const Progress& progress) {
  const Impl& v = volume.impl();
  check(v, bounds, options, certify);
  PixelBounds result;
  result.sampler = choose_sampler(device, volume, options.sampler).first;
  result.light = options.shading ? CertifiedLight::as_drawn : CertifiedLight::unlit;
  result.ray_offset_pixels = ray_offset(v.grid, options);
  const auto start = std::chrono::steady_clock::now();
  Launch launch(v, bounds, options, certify);
  if (result.sampler == SamplerKind::image3d) {
    const Atlas& atlas = v.atlas();
    launch.run(result.sampler, progress, atlas.bricks.buffer(), atlas.images[0], atlas.images[1],
               atlas.images[2]);
  } else {
    launch.run(result.sampler, progress, v.field.bricks.buffer(), v.field.samples.buffer());
  }
  const auto least = launch.least(), most = launch.most();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.lo = result.hi = FloatImage{options.width, options.height, {}, 3};
  for (std::size_t i = 0; i < least.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      result.lo.values.push_back(least[i].s[c]);
      result.hi.values.push_back(most[i].s[c]);
    }
    result.parts.push_back(static_cast<std::uint32_t>(least[i].s[3]));
    result.untested.push_back((static_cast<int>(most[i].s[3]) & VDVR_PIXEL_UNTESTED) != 0 ? 1 : 0);
  }
  return result;
}

}  // namespace vdvr
