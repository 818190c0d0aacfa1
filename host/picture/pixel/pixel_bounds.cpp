// Launches kernels/picture/pixel/pixel_bounds.cl: certify_picture, certify_fast.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "host/picture/pixel/range_table.hpp"
#include "host/picture/render/bake.hpp"
#include "host/picture/render/check_render_options.hpp"
#include "host/picture/render/glm_vectors.hpp"
#include "host/picture/render/raycast.hpp"
#include "host/picture/render/raycast_params.hpp"
#include "host/volume/sampler/picture_parts.hpp"
#include "shared/certify_params.h"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/stop.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr {
namespace {

using opencl::DeviceArray;
using Impl = ResidentVolume::Impl;

static_assert(sizeof(VdvrCertify) == 128);

constexpr double kUnit = 0x1p-24;
// Of the list of pieces; what a picture needs beyond is made by smaller launches.
constexpr std::uint64_t kListBytes = std::uint64_t{192} << 20;
// Of a launch: between two of them a stop is heard.
constexpr std::int64_t kBandRows = 64;

/// What is certified: a whole volume's field, wherever its samples lie.
struct Subject {
  DrawnField field;
  const FieldFacts& facts;
  SamplerKind sampler;
  int lanes;
};

void check(const Subject& v, const std::vector<float>& bounds, const RenderOptions& o,
           const CertifyPictureOptions& c) {
  if (o.mode != RenderMode::dvr || o.output != RenderOutput::colour)
    throw InputError("only colours of `mode` dvr are certified pixel by pixel");
  if (o.shading && o.gradient == GradientKind::stored)
    throw InputError(
        "`gradient` stored: certified pictures take central or analytic, which need no other field");
  if (bounds.size() != v.field.ranges.size())
    throw InputError(fmt::format("{} bounds for {} bricks", bounds.size(), v.field.ranges.size()));
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

VdvrCertify make_certify(const Subject& v, const RenderOptions& o, const CertifyPictureOptions& c,
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
  q.slack = static_cast<float>(18 * kUnit * static_cast<double>(v.facts.largest));
  // Entry and product: 4 u of the cells of an axis.
  q.reach[0] = static_cast<float>(4 * kUnit * v.field.bricks.cells_x);
  q.reach[1] = static_cast<float>(4 * kUnit * v.field.bricks.cells_y);
  q.reach[2] = static_cast<float>(4 * kUnit * v.field.bricks.cells_z);
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
std::vector<std::uint8_t> clear_bricks(const Subject& v, const VdvrCertify& q, const RangeTable& table,
                                       const std::vector<float>& bounds, bool windowed) {
  const float reach = std::ldexp(q.reach[0] + q.reach[1] + q.reach[2], v.field.highest_level);
  std::vector<std::uint8_t> clear(bounds.size());
  for (std::size_t i = 0; i < clear.size(); ++i) {
    const cl_float2 r = v.field.ranges[i];
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

/// The tables of a picture's intervals on the device, and the intervals themselves.
class Launch {
 public:
  Launch(const Subject& v, const std::vector<float>& bounds, const RenderOptions& o,
         const CertifyPictureOptions& c, const Progress& progress)
      : v_(v),
        o_(o),
        certify_(c),
        progress_(progress),
        table_(make_range_table(o.transfer, typical_bound(bounds), c.window.has_value())) {
    q_ = make_certify(v, o, c, table_, ending_share(c.theta, bounds, o.transfer));
    q_.capacity = 64;
    opencl::State& state = *v.field.state;
    const VdvrGrid& grid = v.field.bricks;
    const auto clear = clear_bricks(v, q_, table_, bounds, c.window.has_value());
    const auto distance = distance_to_other(clear, {grid.bricks_x, grid.bricks_y, grid.bricks_z});
    distance_ = DeviceArray<cl_uchar>(state, distance, "distances to bricks that may show something");
    bounds_ = DeviceArray<float>(state, bounds, "bounds of bricks");
    ranges_ = DeviceArray<cl_float4>(state, table_.rows, "ranges of the transfer function");
    next_ = DeviceArray<cl_int>(state, table_.next_shown, "bins that show something");
    least_ = DeviceArray<cl_float4>(state, pixels(), "lower ends of pixels");
    most_ = DeviceArray<cl_float4>(state, pixels(), "upper ends of pixels");
    fullest_ = DeviceArray<cl_uint>(state, 1, "longest list of pieces");
    rays_ = make_params(v.field, o, bake(o.transfer, o.step, 1), q_.slack);
  }

  [[nodiscard]] const VdvrRaycast& rays() const { return rays_; }
  [[nodiscard]] std::uint64_t pixels() const { return static_cast<std::uint64_t>(o_.width * o_.height); }
  /// Of the list of pieces, at most.
  void set_list_bytes(std::uint64_t bytes) { list_bytes_ = bytes; }

  /// Some pixels. `volume` has the samples that their rays may read.
  void run(const Impl& volume, const PixelBox& pixels) {
    const auto with = [&](const cl::Buffer& bricks, const auto&... field) {
      const auto defines = defines_for(volume);
      if (certify_.fast) fast(defines, pixels, bricks, field...);
      else exact(defines, pixels, bricks, field...);
    };
    if (v_.sampler == SamplerKind::image3d) {
      const Atlas& atlas = volume.atlas();
      with(atlas.bricks.buffer(), atlas.images[0], atlas.images[1], atlas.images[2]);
    } else {
      with(volume.field.bricks.buffer(), volume.field.samples.buffer());
    }
  }

  /// What was found.
  void read(PixelBounds& result) const {
    const auto least = least_.to_host(), most = most_.to_host();
    result.lo = result.hi = FloatImage{o_.width, o_.height, {}, 3};
    for (std::size_t i = 0; i < least.size(); ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        result.lo.values.push_back(least[i].s[c]);
        result.hi.values.push_back(most[i].s[c]);
      }
      result.parts.push_back(static_cast<std::uint32_t>(least[i].s[3]));
      result.untested.push_back((static_cast<int>(most[i].s[3]) & VDVR_PIXEL_UNTESTED) != 0 ? 1 : 0);
    }
  }

 private:
  [[nodiscard]] opencl::Defines defines_for(const Impl& volume) const {
    const bool analytic = o_.shading && o_.gradient == GradientKind::analytic;
    return with_kernel(
        raycast_defines(volume, o_, v_.sampler, analytic ? GradientKind::analytic : GradientKind::central, {},
                        v_.lanes),
        certify_, o_.shading);
  }
  /// Bands of the pixels, the first one last.
  [[nodiscard]] static std::vector<PixelBox> bands_of(const PixelBox& pixels) {
    std::vector<PixelBox> bands;
    for (std::int64_t y = pixels.y0; y < pixels.y1; y += kBandRows)
      bands.push_back({pixels.x0, y, pixels.x1, std::min(y + kBandRows, pixels.y1)});
    std::reverse(bands.begin(), bands.end());
    return bands;
  }
  opencl::Range set_pixels(const PixelBox& box) {
    q_.first_column = static_cast<int>(box.x0);
    q_.columns = static_cast<int>(box.x1 - box.x0);
    q_.first_row = static_cast<int>(box.y0);
    q_.rows = static_cast<int>(box.y1 - box.y0);
    RenderOptions drawn = o_;
    drawn.width = box.x1 - box.x0;
    drawn.height = box.y1 - box.y0;
    const opencl::Range range = packet_range(drawn, {}, v_.lanes);
    const auto items = [&](std::size_t a) { return opencl::round_up(range.global[a], range.local[a]); };
    q_.items_x = static_cast<int>(items(0));
    q_.items = static_cast<int>(items(0) * items(1));
    return range;
  }
  void is_done(const PixelBox& box) {
    throw_if_stopped();
    done_ += static_cast<std::uint64_t>((box.x1 - box.x0) * (box.y1 - box.y0));
    report(progress_, "certify", static_cast<double>(done_) / static_cast<double>(pixels()));
  }

  template <class... Field>
  void fast(const opencl::Defines& defines, const PixelBox& pixels, const cl::Buffer& bricks,
            const Field&... field) {
    opencl::Kernel<Field..., cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                   VdvrRaycast, VdvrCertify, cl::Buffer, cl::Buffer>
        kernel(*v_.field.state, "picture/pixel/pixel_bounds", "certify_fast", defines);
    std::vector<PixelBox> todo = bands_of(pixels);
    for (; !todo.empty(); todo.pop_back()) {
      const opencl::Range range = set_pixels(todo.back());
      kernel(range, field..., bricks, v_.field.bricks, distance_.buffer(), bounds_.buffer(), ranges_.buffer(),
             next_.buffer(), rays_, q_, least_.buffer(), most_.buffer());
      opencl::finish(*v_.field.state, "certifying pixels");
      is_done(todo.back());
    }
  }

  template <class... Field>
  void exact(const opencl::Defines& defines, const PixelBox& pixels, const cl::Buffer& bricks,
             const Field&... field) {
    opencl::Kernel<Field..., cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                   VdvrRaycast, VdvrCertify, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer>
        kernel(*v_.field.state, "picture/pixel/pixel_bounds", "certify_picture", defines);
    std::vector<PixelBox> todo = bands_of(pixels);
    while (!todo.empty()) {
      const PixelBox box = todo.back();
      const opencl::Range range = set_pixels(box);
      const std::uint64_t floats = list_size(range);
      if (floats * sizeof(float) > list_bytes_ && halve(todo)) continue;
      if (list_.size() < floats) {
        list_ = {};
        list_ = DeviceArray<float>(*v_.field.state, floats, "pieces of rays");
      }
      fullest_.fill(0);
      kernel(range, field..., bricks, v_.field.bricks, distance_.buffer(), bounds_.buffer(), ranges_.buffer(),
             next_.buffer(), rays_, q_, least_.buffer(), most_.buffer(), list_.buffer(), fullest_.buffer());
      cl_uint fullest = 0;
      fullest_.read({&fullest, 1});
      if (fullest <= static_cast<cl_uint>(q_.capacity)) {
        todo.pop_back();
        is_done(box);
        continue;
      }
      // Some lists were too short: the same pixels once more.
      throw_if_stopped();
      q_.capacity = static_cast<int>(fullest + fullest / 8);
    }
  }

  /// Numbers in the list of a launch.
  [[nodiscard]] std::uint64_t list_size(const opencl::Range& range) const {
    const std::uint64_t packets = opencl::round_up(range.global[0], range.local[0]) *
                                  opencl::round_up(range.global[1], range.local[1]),
                        numbers = o_.shading ? VDVR_LIT_PIECE_NUMBERS : VDVR_PIECE_NUMBERS;
    return packets * static_cast<std::uint64_t>(v_.lanes) * numbers * static_cast<std::uint64_t>(q_.capacity);
  }
  /// Cuts the last box in two, between work-groups; false where it is one.
  static bool halve(std::vector<PixelBox>& todo) {
    constexpr std::int64_t side = PictureParts::least_side;
    const PixelBox box = todo.back();
    const std::int64_t width = box.x1 - box.x0, height = box.y1 - box.y0;
    if (width <= side && height <= side) return false;
    PixelBox first = box, second = box;
    const auto half = [](std::int64_t n) { return (n / 2 + side - 1) / side * side; };
    if (height > side) first.y1 = second.y0 = box.y0 + half(height);
    else first.x1 = second.x0 = box.x0 + half(width);
    todo.back() = second;
    todo.push_back(first);
    return true;
  }

  const Subject& v_;
  const RenderOptions& o_;
  const CertifyPictureOptions& certify_;
  const Progress& progress_;
  RangeTable table_;
  VdvrCertify q_{};
  VdvrRaycast rays_{};
  std::uint64_t list_bytes_ = kListBytes, done_ = 0;
  DeviceArray<cl_uchar> distance_;
  DeviceArray<float> bounds_, list_;
  DeviceArray<cl_float4> ranges_, least_, most_;
  DeviceArray<cl_int> next_;
  DeviceArray<cl_uint> fullest_;
};

PixelBounds nothing_yet(const Subject& v, const RenderOptions& o) {
  PixelBounds result;
  result.sampler = v.sampler;
  result.light = o.shading ? CertifiedLight::as_drawn : CertifiedLight::unlit;
  result.ray_offset_pixels = ray_offset(v.field.grid, o);
  return result;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

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
  require_trusted(device, "certifying a picture");
  check_options(options);
  const SamplerKind sampler = choose_sampler(device, volume, options.sampler).first;
  const Subject subject{drawn_field(volume), *v.facts, sampler,
                        lanes_for(v, sampler, GradientKind::central, {})};
  check(subject, bounds, options, certify);
  PixelBounds result = nothing_yet(subject, options);
  const auto start = std::chrono::steady_clock::now();
  Launch launch(subject, bounds, options, certify, progress);
  launch.run(v, {0, 0, options.width, options.height});
  launch.read(result);
  result.seconds = seconds_since(start);
  return result;
}

PixelBounds certify_pixels(Device& device, const PagedVolume& volume, const std::vector<float>& bounds,
                           const RenderOptions& options, const CertifyPictureOptions& certify,
                           const Progress& progress) {
  const PagedVolume::Impl& v = volume.impl();
  require_trusted(device, "certifying a picture");
  check_options(options);
  const SamplerKind sampler = choose_sampler(options.sampler).first;
  const Subject subject{
      drawn_field(volume), *v.facts, sampler,
      lanes_for(*v.state, v.highest_place(), 3 * v.facts->ranges.size(), sampler, GradientKind::central, {})};
  check(subject, bounds, options, certify);
  PixelBounds result = nothing_yet(subject, options);
  const auto start = std::chrono::steady_clock::now();
  Launch launch(subject, bounds, options, certify, progress);
  // Bricks have what the list, and the intervals on the host, leave.
  const std::uint64_t list = std::min(kListBytes, device.memory_left() / 8);
  launch.set_list_bytes(list);
  const PartNeeds needs{false, options.shading, list + 2 * sizeof(cl_float4) * launch.pixels()};
  const PictureParts parts(v, launch.rays(), needs);
  parts.each({0, 0, options.width, options.height},
             [&](const PixelBox& pixels, std::vector<std::uint8_t> here) {
               const auto part = v.load(std::move(here), false);
               launch.run(*part, pixels);
             });
  launch.read(result);
  result.seconds = seconds_since(start);
  return result;
}

}  // namespace vdvr
