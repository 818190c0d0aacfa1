// Places in integers: a sample's distance from its brick's first is a small number of 2^-per_cell cells.
#include "host/volume/sampler/sample_box.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/volume/brick_layout.hpp"

namespace vdvr {
namespace {

/// log2 of samples per cell where the spacing is a cell over a power of two, as exports have them.
std::optional<int> power_of(double cell, double spacing) {
  int exponent = 0;
  if (std::frexp(cell / spacing, &exponent) != 0.5 || std::ldexp(spacing, exponent - 1) != cell) return {};
  const int k = exponent - 1;
  return k >= 0 && k <= 6 ? std::optional(k) : std::nullopt;
}

/// The samples of one axis that one brick answers for.
struct Run {
  std::int64_t brick = 0, first = 0, count = 0;  // `first` from the box's first
};

std::vector<Run> runs_along(const MixedVolume& v, const SampleBox& box, std::size_t a) {
  std::vector<Run> runs;
  const std::int64_t end = box.first[a] + box.count[a];
  for (std::int64_t b = box.first_brick[a]; b < box.end_brick[a]; ++b) {
    // Half-open: the first sample at or above the brick's first cell. The last brick takes what is left.
    const auto first_at = [&](std::int64_t brick) {
      const std::int64_t cell = brick * v.granularity;
      const int k = box.per_cell[a];
      return k >= 0 ? cell << k : (cell + (std::int64_t{1} << -k) - 1) >> -k;
    };
    const std::int64_t lo = b == box.first_brick[a] ? box.first[a] : std::max(box.first[a], first_at(b));
    const std::int64_t hi = b + 1 == box.end_brick[a] ? end : std::min(end, first_at(b + 1));
    if (lo < hi) runs.push_back({b, lo - box.first[a], hi - lo});
  }
  return runs;
}

/// Where the samples of a run lie among the brick's own.
void places_along(const MixedVolume& v, const SampleBox& box, const Run& run, std::size_t a, int level,
                  std::vector<VdvrLocal>& places) {
  const int coarse = v.coarsening[2 - a];
  const std::int64_t first_cell = run.brick * v.granularity;
  const std::int64_t width = std::min<std::int64_t>(v.granularity, v.grid.cells[a] - first_cell);
  const std::int64_t last = width << level >> coarse;
  places.clear();
  for (std::int64_t i = 0; i < run.count; ++i) {
    const std::int64_t sample = box.first[a] + run.first + i;
    // The distance in units of 2^-k cells, or in cells where samples are coarser than those.
    const int k = box.per_cell[a];
    const std::int64_t distance = k >= 0 ? sample - (first_cell << k) : (sample << -k) - first_cell;
    const auto r = std::ldexp(static_cast<float>(distance), level - coarse - std::max(k, 0));
    VdvrLocal place;
    place.index =
        static_cast<std::int32_t>(std::clamp<std::int64_t>(static_cast<std::int64_t>(r), 0, last - 1));
    place.fraction = r - static_cast<float>(place.index);
    places.push_back(place);
  }
}

/// The largest difference of brick p and its neighbour q = p + step (each 0 or 1) on what they share.
float jump_between(const MixedVolume& v, const Index3& p, const Index3& step) {
  const Index3 q{p[0] + step[0], p[1] + step[1], p[2] + step[2]};
  const BrickSamples sp(v, p), sq(v, q);
  // Both as a box of the samples of either: one plane where they touch.
  SampleBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.per_cell[a] = std::max(sp.per_cell()[a], sq.per_cell()[a]);
    const int k = box.per_cell[a];
    const auto sample = [&](std::int64_t cell) { return k >= 0 ? cell << k : cell >> -k; };
    box.first[a] = sample(q[a] * v.granularity);
    box.count[a] =
        step[a] == 1 ? 1 : sample(std::min(v.grid.cells[a], (q[a] + 1) * v.granularity)) - box.first[a] + 1;
  }
  std::array<std::array<std::vector<VdvrLocal>, 3>, 2> places;
  for (std::size_t a = 0; a < 3; ++a) {
    places_along(v, box, {p[a], 0, box.count[a]}, a, sp.level()[a], places[0][a]);
    places_along(v, box, {q[a], 0, box.count[a]}, a, sq.level()[a], places[1][a]);
  }
  float jump = 0;
  for (std::size_t z = 0; z < places[0][2].size(); ++z)
    for (std::size_t y = 0; y < places[0][1].size(); ++y)
      for (std::size_t x = 0; x < places[0][0].size(); ++x)
        jump = std::max(jump, std::abs(sp.at(places[0][0][x], places[0][1][y], places[0][2][z]) -
                                       sq.at(places[1][0][x], places[1][1][y], places[1][2][z])));
  return jump;
}

}  // namespace

std::optional<SampleBox> exact_box(const MixedVolume& v, const Lattice& lattice) {
  SampleBox box;
  box.first = lattice.first;
  box.count = lattice.count;
  box.end_brick = v.bricks();
  for (std::size_t a = 0; a < 3; ++a) {
    const auto k = power_of(v.grid.spacing[a], lattice.spacing[a]);
    if (!k || lattice.origin[a] != v.grid.origin[a]) return {};
    box.per_cell[a] = *k;
  }
  return box;
}

double largest_jump(const MixedVolume& v, const Progress& progress) {
  const Index3 n = v.bricks();
  float largest = 0;
  std::mutex lock;
  parallel_for(n[2] * n[1], progress, "faces", [&](std::int64_t row) {
    float jump = 0;
    for (std::int64_t x = 0; x < n[0]; ++x)
      for (std::int64_t code = 1; code < 8; ++code) {
        const Index3 p{x, row % n[1], row / n[1]}, step{code & 1, code >> 1 & 1, code >> 2};
        if (p[0] + step[0] == n[0] || p[1] + step[1] == n[1] || p[2] + step[2] == n[2]) continue;
        // Two of level 0 read the same samples.
        const Index3 q{p[0] + step[0], p[1] + step[1], p[2] + step[2]};
        const auto in_base = [&](const Index3& b) {
          return v.level[at((b[2] * n[1] + b[1]) * n[0] + b[0])] == LevelTriple{};
        };
        if (!in_base(p) || !in_base(q)) jump = std::max(jump, jump_between(v, p, step));
      }
    const std::lock_guard guard(lock);
    largest = std::max(largest, jump);
  });
  return static_cast<double>(largest);
}

Index3 fine_samples(const Grid& grid, int log2_per_cell) {
  Index3 n{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (grid.cells[a] << log2_per_cell) + 1;
  return n;
}

SampleBox planes_of(const MixedVolume& v, int log2_per_cell, std::int64_t first, std::int64_t planes) {
  const Index3 n = fine_samples(v.grid, log2_per_cell);
  return {{log2_per_cell, log2_per_cell, log2_per_cell}, {0, 0, first}, {n[0], n[1], planes}, {}, v.bricks()};
}

void sample_box(const MixedVolume& v, const SampleBox& box, std::int64_t stride_y, std::int64_t stride_z,
                float* out) {
  const std::vector<Run> along_x = runs_along(v, box, 0), along_y = runs_along(v, box, 1),
                         along_z = runs_along(v, box, 2);
  std::vector<VdvrLocal> xs, ys, zs;
  for (const Run& rz : along_z)
    for (const Run& ry : along_y)
      for (const Run& rx : along_x) {
        const BrickSamples stored(v, {rx.brick, ry.brick, rz.brick});
        const std::array<int, 3> level = stored.level();
        places_along(v, box, rx, 0, level[0], xs);
        places_along(v, box, ry, 1, level[1], ys);
        places_along(v, box, rz, 2, level[2], zs);
        for (std::size_t z = 0; z < zs.size(); ++z)
          for (std::size_t y = 0; y < ys.size(); ++y) {
            float* row = out + (rz.first + static_cast<std::int64_t>(z)) * stride_z +
                         (ry.first + static_cast<std::int64_t>(y)) * stride_y + rx.first;
            for (const VdvrLocal& x : xs) *row++ = stored.at(x, ys[y], zs[z]);
          }
      }
}

void sample_box_parallel(const MixedVolume& v, const SampleBox& box, float* out) {
  // Rows of bricks along y, in strips of z: what a thread takes is large beside taking it.
  const int k = std::max(box.per_cell[1], 0);
  const std::int64_t rows = std::max<std::int64_t>(v.granularity << k, 1), planes = rows;
  const std::int64_t stride_z = box.count[0] * box.count[1];
  const std::int64_t in_y = (box.count[1] + rows - 1) / rows, in_z = (box.count[2] + planes - 1) / planes;
  parallel_for(in_y * in_z, {}, "export", [&](std::int64_t part) {
    const std::int64_t y = part % in_y * rows, z = part / in_y * planes;
    SampleBox one = box;
    one.first[1] += y;
    one.first[2] += z;
    one.count[1] = std::min(rows, box.count[1] - y);
    one.count[2] = std::min(planes, box.count[2] - z);
    sample_box(v, one, box.count[0], stride_z, out + z * stride_z + y * box.count[0]);
  });
}

std::pair<double, double> range_of_samples(const MixedVolume& v, const Progress& progress) {
  const Index3 n = v.bricks();
  float lowest = std::numeric_limits<float>::max(), highest = std::numeric_limits<float>::lowest();
  std::mutex lock;
  parallel_for(n[2] * n[1], progress, "range", [&](std::int64_t row) {
    float lo = std::numeric_limits<float>::max(), hi = std::numeric_limits<float>::lowest();
    for (std::int64_t bx = 0; bx < n[0]; ++bx) {
      const BrickSamples stored(v, {bx, row % n[1], row / n[1]});
      const Index3 end = stored.end();
      for (std::int64_t z = 0; z <= end[2]; ++z)
        for (std::int64_t y = 0; y <= end[1]; ++y)
          for (std::int64_t x = 0; x <= end[0]; ++x) {
            const float value = stored(x, y, z);
            lo = std::min(lo, value);
            hi = std::max(hi, value);
          }
    }
    const std::lock_guard guard(lock);
    lowest = std::min(lowest, lo);
    highest = std::max(highest, hi);
  });
  return {static_cast<double>(lowest), static_cast<double>(highest)};
}

std::uint64_t resident_bytes(const MixedVolume& v) {
  std::uint64_t bytes = v.level.size() * (sizeof(LevelTriple) + sizeof(std::uint32_t)), in_scratch = 0;
  for_each_array(v, [&](const auto& samples) {
    // All files of one scratch share what may be resident.
    if (samples.scratch()) in_scratch = std::max(in_scratch, samples.resident_bytes());
    else bytes += samples.resident_bytes();
  });
  return bytes + in_scratch;
}

void require_memory_of_cores(const MixedVolume& v, std::uint64_t per_core, std::uint64_t shared,
                             std::uint64_t limit, const std::string& what) {
  if (limit == 0) return;
  const std::uint64_t cores = std::max(1u, std::thread::hardware_concurrency());
  io::require_memory(resident_bytes(v) + shared + cores * per_core, limit,
                     what + ": the volume and what each core works on");
}

}  // namespace vdvr
