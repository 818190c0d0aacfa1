// A picture is cut in two, and each half again, until the bricks that the rays of a part may read fit the
// device; then they are brought there and the ray-caster draws that part's pixels from end to end. Rays are
// independent of one another and of what else lies in the buffer, so that no state is carried from part to
// part and every bit is that of the whole volume.
//
// What rays may read: the pixels of a part span a pyramid from the eye. Every brick that meets it, made wider
// by what rounding can move a ray, holds samples or belongs to none; gradients reach half a cell beyond, into
// bricks that touch those.
#include "host/render/raycast.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <tuple>

#include "host/render/check_render_options.hpp"
#include "host/render/glm_vectors.hpp"
#include "host/render/raycast_params.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// PixelBox along a side below which no part is cut: a work-group.
constexpr std::int64_t kLeastSide = 8;

// A box in cells, or the pyramid of some pixels within it.
struct Beam {
  glm::dvec3 low{0}, high{0};     ///< cells
  glm::dvec3 eye{0};              ///< cells
  std::vector<glm::dvec3> sides;  ///< normals, inward, of planes through the eye

  [[nodiscard]] bool meets(const glm::dvec3& brick_low, const glm::dvec3& brick_high) const {
    for (int a = 0; a < 3; ++a)
      if (brick_high[a] < low[a] || brick_low[a] > high[a]) return false;
    const glm::dvec3 middle = 0.5 * (brick_low + brick_high) - eye, half = 0.5 * (brick_high - brick_low);
    return std::all_of(sides.begin(), sides.end(), [&](const glm::dvec3& n) {
      return glm::dot(n, middle) + glm::dot(glm::abs(n), half) >= 0;
    });
  }
};

Beam beam_of(const VdvrRaycast& p, const PixelBox& part) {
  const glm::dvec3 scale(p.cells_per_length_x, p.cells_per_length_y, p.cells_per_length_z);
  const auto direction = [&](std::int64_t x, std::int64_t y) {
    const double across = 2 * static_cast<double>(x) / p.width - 1,
                 above = 1 - 2 * static_cast<double>(y) / p.height;
    return scale * (glm::dvec3(p.forward_x, p.forward_y, p.forward_z) +
                    across * glm::dvec3(p.right_x, p.right_y, p.right_z) +
                    above * glm::dvec3(p.up_x, p.up_y, p.up_z));
  };
  Beam beam;
  beam.eye = {p.eye_x, p.eye_y, p.eye_z};
  beam.low = {p.clip_low[0], p.clip_low[1], p.clip_low[2]};
  beam.high = {p.clip_high[0], p.clip_high[1], p.clip_high[2]};
  const std::array<glm::dvec3, 4> corner{direction(part.x0, part.y0), direction(part.x1, part.y0),
                                         direction(part.x1, part.y1), direction(part.x0, part.y1)};
  const glm::dvec3 inside = corner[0] + corner[1] + corner[2] + corner[3];
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec3 n = glm::cross(corner[i], corner[(i + 1) % 4]);
    beam.sides.push_back(glm::dot(n, inside) < 0 ? -n : n);
  }
  return beam;
}

Beam beam_of(const VdvrSlice& s, const PixelBox& part) {
  Beam beam;
  for (int a = 0; a < 3; ++a) beam.low[a] = beam.high[a] = static_cast<double>(s.first[a]);
  const auto span = [&](int axis, float step, std::int64_t from, std::int64_t to) {
    const double first = static_cast<double>(s.first[axis]), width = static_cast<double>(step);
    beam.low[axis] = first + static_cast<double>(from) * width;
    beam.high[axis] = first + static_cast<double>(to) * width;
  };
  span(s.across, s.step_across, part.x0, part.x1);
  span(s.down, s.step_down, part.y0, part.y1);
  return beam;
}

class Parts {
 public:
  Parts(const PagedVolume::Impl& volume, const RenderOptions& options, bool lit, const VdvrRaycast& rays,
        const VdvrSlice& slice)
      : volume_(volume), options_(options), lit_(lit), rays_(rays), slice_(slice) {
    const auto reaches = options.mode == RenderMode::dvr || options.mode == RenderMode::iso;
    beside_ = reaches && (options.shading || options.output == RenderOutput::normal);
    // Rounding moves a position by 2^-22 of the lengths that are added; an eighth of a cell covers what
    // kernels add to leave a brick.
    const VdvrGrid& g = volume.grid;
    const std::array<double, 3> cells{static_cast<double>(g.cells_x), static_cast<double>(g.cells_y),
                                      static_cast<double>(g.cells_z)},
        eye{rays.eye_x, rays.eye_y, rays.eye_z};
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      wider_[a] = 0.125 + 0x1p-19 * (2 * std::abs(eye[i]) + cells[i]);
    }
    // The picture lies on the device by now, and will on the host.
    const std::uint64_t left = volume.state->memory.left(),
                        picture =
                            sizeof(cl_float4) * static_cast<std::uint64_t>(options.width * options.height);
    limit_ = std::min(volume.memory, left > picture ? left - picture : 0);
    drawn_.assign(volume.facts->ranges.size(), 0u);
    std::iota(drawn_.begin(), drawn_.end(), 0u);
  }

  /// draw(pixels, flags of bricks) part after part.
  template <class Draw>
  void each(const Rows& rows, Draw&& draw) const {
    cut({0, rows.first, options_.width, rows.end}, drawn_, draw);
  }

 private:
  /// Those of `bricks` that rays of these pixels may pass.
  [[nodiscard]] std::vector<std::uint32_t> met(const PixelBox& part,
                                               const std::vector<std::uint32_t>& bricks) const {
    const Beam beam = options_.mode == RenderMode::slice ? beam_of(slice_, part) : beam_of(rays_, part);
    const VdvrGrid& g = volume_.grid;
    std::vector<std::uint32_t> some;
    for (const std::uint32_t i : bricks) {
      const glm::dvec3 at = position(i);
      const glm::dvec3 low = at * static_cast<double>(g.granularity),
                       high = low + static_cast<double>(g.granularity);
      if (beam.meets(low - wider_, high + wider_)) some.push_back(i);
    }
    return some;
  }

  [[nodiscard]] glm::dvec3 position(std::uint32_t brick) const {
    const auto x = static_cast<std::uint32_t>(volume_.grid.bricks_x),
               y = static_cast<std::uint32_t>(volume_.grid.bricks_y);
    return {brick % x, brick / x % y, brick / x / y};
  }

  /// By brick 1 where samples may be read; nothing where they do not fit.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> wanted(
      const std::vector<std::uint32_t>& bricks) const {
    const VdvrGrid& g = volume_.grid;
    std::vector<std::uint8_t> here(drawn_.size());
    std::uint64_t samples = 0, stored = 0, bytes = 0;
    const auto want = [&](std::size_t brick) {
      if (here[brick] != 0) return;
      here[brick] = 1;
      samples += volume_.samples_of(brick);
      stored += volume_.stored_bytes_of(brick);
      bytes += volume_.bytes_of(brick, lit_);
    };
    const int away = beside_ ? 1 : 0;
    for (const std::uint32_t i : bricks) {
      const glm::dvec3 at = position(i);
      const auto x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
      for (int bz = std::max(z - away, 0); bz <= std::min(z + away, g.bricks_z - 1); ++bz)
        for (int by = std::max(y - away, 0); by <= std::min(y + away, g.bricks_y - 1); ++by)
          for (int bx = std::max(x - away, 0); bx <= std::min(x + away, g.bricks_x - 1); ++bx)
            want((static_cast<std::size_t>(bz) * static_cast<std::size_t>(g.bricks_y) +
                  static_cast<std::size_t>(by)) *
                     static_cast<std::size_t>(g.bricks_x) +
                 static_cast<std::size_t>(bx));
    }
    needed_ = volume_.fixed_bytes(lit_) + bytes;
    if (!volume_.fits(samples, stored, bytes, lit_, limit_)) return std::nullopt;
    return here;
  }

  template <class Draw>
  void cut(const PixelBox& part, const std::vector<std::uint32_t>& around, Draw&& draw) const {
    const std::vector<std::uint32_t> bricks = met(part, around);
    if (auto here = wanted(bricks)) return draw(part, std::move(*here));
    const std::int64_t width = part.x1 - part.x0, height = part.y1 - part.y0;
    if (width <= kLeastSide && height <= kLeastSide)
      throw ResourceError(fmt::format(
          "the bricks behind {} x {} pixels take {} bytes with base and index, and {} are left for them "
          "under the limit: raise `max_memory`, take a larger `size`, or `gradient` central",
          width, height, needed_, limit_));
    const auto half = [](std::int64_t n) { return (n / 2 + kLeastSide - 1) / kLeastSide * kLeastSide; };
    PixelBox first = part, second = part;
    if (width >= height) first.x1 = second.x0 = part.x0 + half(width);
    else first.y1 = second.y0 = part.y0 + half(height);
    cut(first, bricks, draw);
    cut(second, bricks, draw);
  }

  const PagedVolume::Impl& volume_;
  const RenderOptions& options_;
  bool lit_;
  const VdvrRaycast& rays_;
  const VdvrSlice& slice_;
  bool beside_ = false;  ///< gradients are taken
  glm::dvec3 wider_{0};  ///< cells
  std::vector<std::uint32_t> drawn_;
  std::uint64_t limit_ = 0;  ///< of what is on the device for a part
  mutable std::uint64_t needed_ = 0;
};

}  // namespace

bool stored_would_fit(const PagedVolume& volume) {
  const PagedVolume::Impl& v = volume.impl();
  const DeviceInfo& d = v.state->info;
  return v.whole_lit <= static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max()) &&
         8 * v.whole_lit <= d.max_allocation &&
         sample_buffer_bytes(*v.volume) + 8 * v.whole_lit <= d.global_memory / 2;
}

DrawnField drawn_field(const PagedVolume& volume) {
  const PagedVolume::Impl& v = volume.impl();
  const FieldFacts& f = *v.facts;
  return {v.state, v.volume->grid, v.grid, f.ranges, f.value_range, f.highest_level, f.has_tile};
}

std::pair<SamplerKind, std::string> choose_sampler(SamplerKind asked) {
  if (asked == SamplerKind::image3d)
    throw ResourceError(
        "the image3d sampler cannot be used: the volume is brought to the device by bricks, and what a "
        "texture "
        "unit reads depends in its last bits on where a tile lies; use `sampler` buffer");
  return {SamplerKind::buffer, asked == SamplerKind::buffer ? "asked for" : "the volume comes by bricks"};
}

Enqueued enqueue_frame(Frame& frame, Device& device, const PagedVolume& volume, const RenderOptions& o,
                       const RaycastTuning& tuning, std::optional<Rows> rows) {
  check_options(o);
  const PagedVolume::Impl& v = volume.impl();
  if (o.output == RenderOutput::error && !frame.has_bounds())
    throw InputError("`show` error: the renderer has no bounds by brick");
  FramePlan plan;
  plan.tuning = tuning;
  plan.tuning.group_x = plan.tuning.group_y = static_cast<int>(kLeastSide);
  std::tie(plan.sampler, plan.sampler_reason) = choose_sampler(o.sampler);
  plan.slack = range_slack(device, *v.facts, plan.sampler);
  plan.gradient = choose_gradient(o, plan.sampler, stored_would_fit(volume));
  plan.lanes = lanes_for(*v.state, v.highest_place(), 3 * v.facts->ranges.size(), plan.sampler, plan.gradient,
                         plan.tuning);
  const BakedTransfer& table = frame.prepare(o, plan.slack, base_first(o, plan.gradient, plan.lanes));
  opencl::finish(*v.state, "preparing a frame");
  const auto start = std::chrono::steady_clock::now();
  const bool lit = plan.gradient == GradientKind::stored;
  const bool flat = o.mode == RenderMode::slice;
  const VdvrRaycast rays = flat ? VdvrRaycast{} : make_params(frame.field(), o, table, plan.slack);
  const VdvrSlice slice = flat ? make_slice(frame.field(), o) : VdvrSlice{};
  const Parts parts(v, o, lit, rays, slice);
  parts.each(rows.value_or(Rows{0, o.height}), [&](const PixelBox& pixels, std::vector<std::uint8_t> here) {
    const auto part = v.load(std::move(here), lit);
    draw_pixels(frame, *part, o, plan, table, pixels);
    opencl::finish(*v.state, "drawing a part of a picture");
  });
  return {plan.sampler, std::move(plan.sampler_reason), plan.gradient, start};
}

}  // namespace vdvr
