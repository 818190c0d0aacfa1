// What rays may read: the pixels of a part span a pyramid from the eye. Every brick that meets it, made wider
// by what rounding can move a ray, holds samples or belongs to none; gradients reach half a cell beyond, into
// bricks that touch those. Rays are independent of one another and of what else lies in the sample buffer, so
// that no state is carried from part to part and every bit is that of the whole volume.
#include "host/volume/sampler/picture_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <numeric>

#include "vdvr/error.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {
namespace {

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

}  // namespace

PictureParts::PictureParts(const PagedVolume::Impl& volume, const std::variant<VdvrRaycast, VdvrSlice>& rays,
                           const PartNeeds& needs)
    : volume_(volume), rays_(rays), needs_(needs) {
  // Rounding moves a position by 2^-22 of the lengths that are added; an eighth of a cell covers what
  // kernels add to leave a brick.
  const VdvrGrid& g = volume.grid;
  const glm::dvec3 cells(g.cells_x, g.cells_y, g.cells_z);
  glm::dvec3 eye{0};
  if (const auto* p = std::get_if<VdvrRaycast>(&rays_)) eye = {p->eye_x, p->eye_y, p->eye_z};
  wider_ = 0.125 + 0x1p-19 * (2.0 * glm::abs(eye) + cells);
  const std::uint64_t left = volume.state->memory.left();
  limit_ = std::min(volume.memory, left > needs.aside ? left - needs.aside : 0);
  all_.assign(volume.facts->ranges.size(), 0u);
  std::iota(all_.begin(), all_.end(), 0u);
}

void PictureParts::each(const PixelBox& picture, const Draw& draw) const {
  Plan plan;
  cut(picture, all_, plan);
  if (plan.lacking > 0) refuse(plan);
  for (const PixelBox& part : plan.parts) {
    throw_if_stopped();
    draw(part, wanted(met(part, all_)).here);
  }
}

/// Those of `bricks` that rays of these pixels may pass.
PictureParts::Bricks PictureParts::met(const PixelBox& part, const Bricks& bricks) const {
  const Beam beam = std::visit([&](const auto& rays) { return beam_of(rays, part); }, rays_);
  const double side = volume_.grid.granularity;
  Bricks some;
  for (const std::uint32_t i : bricks) {
    const glm::dvec3 low = position(i) * side, high = low + side;
    if (beam.meets(low - wider_, high + wider_)) some.push_back(i);
  }
  return some;
}

glm::dvec3 PictureParts::position(std::uint32_t brick) const {
  const auto x = static_cast<std::uint32_t>(volume_.grid.bricks_x),
             y = static_cast<std::uint32_t>(volume_.grid.bricks_y);
  return {brick % x, brick / x % y, brick / x / y};
}

PictureParts::Wanted PictureParts::wanted(const Bricks& bricks) const {
  const VdvrGrid& g = volume_.grid;
  Wanted w{std::vector<std::uint8_t>(all_.size()), 0, false};
  std::uint64_t samples = 0, stored = 0, bytes = 0;
  const auto want = [&](std::size_t brick) {
    if (w.here[brick] != 0) return;
    w.here[brick] = 1;
    samples += volume_.samples_of(brick);
    stored += volume_.stored_bytes_of(brick);
    bytes += volume_.bytes_of(brick, needs_.lit);
  };
  const int away = needs_.beside ? 1 : 0;
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
  w.device_bytes = volume_.device_bytes(bytes, needs_.lit);
  w.fits = w.device_bytes <= limit_ && volume_.is_addressable(samples, stored, needs_.lit);
  return w;
}

void PictureParts::cut(const PixelBox& part, const Bricks& around, Plan& plan) const {
  const Bricks bricks = met(part, around);
  const Wanted w = wanted(bricks);
  if (w.fits) {
    plan.parts.push_back(part);
    return;
  }
  const std::int64_t width = part.x1 - part.x0, height = part.y1 - part.y0;
  if (width <= least_side && height <= least_side) {
    plan.most = std::max(plan.most, w.device_bytes);
    // What a buffer cannot hold no limit would let pass: it counts as lacking, by one byte at least.
    plan.lacking =
        std::max({plan.lacking, std::uint64_t{1}, w.device_bytes - std::min(limit_, w.device_bytes)});
    return;
  }
  const auto half = [](std::int64_t n) { return (n / 2 + least_side - 1) / least_side * least_side; };
  PixelBox first = part, second = part;
  if (width >= height) first.x1 = second.x0 = part.x0 + half(width);
  else first.y1 = second.y0 = part.y0 + half(height);
  cut(first, bricks, plan);
  cut(second, bricks, plan);
}

void PictureParts::refuse(const Plan& plan) const {
  std::string enough;
  const std::uint64_t limit = volume_.asked > 0 ? volume_.asked : volume_.state->memory.limit();
  if (limit > 0 && plan.most > limit_) {
    // Of what the limit grows by, an eighth may go to scratch, and an eighth of the rest is left aside. What
    // comes after this was asked, the probe's tile above all, takes up to a MiB.
    const std::uint64_t least = limit + (plan.lacking / 49 + 1) * 64;
    enough = fmt::format("; a limit of {}M a device would do", (least >> 20) + 2);
  }
  throw ResourceError(
      fmt::format("the bricks behind {0} x {0} pixels take up to {1} bytes with base and index, and {2} are "
                  "left for them "
                  "under the limit{3}: raise `max_memory`, {4}",
                  least_side, plan.most, limit_, enough,
                  needs_.lit ? "take a larger `size`, or `gradient` central" : "or take a larger `size`"));
}

}  // namespace vdvr
