// Compares the samples that neighbouring bricks share.
#include "host/verify_seams.hpp"

#include <algorithm>
#include <bit>
#include <mutex>

#include "host/brick_layout.hpp"
#include "host/parallel.hpp"

namespace vdvr {
namespace {

struct Stored {
  const float* samples;
  std::array<std::int64_t, 3> stride;
  std::array<int, 3> level;  // x, y, z
};

Stored stored(const MixedVolume& v, const std::map<LevelTriple, std::uint64_t>& offsets, const Index3& b) {
  const Index3 n = v.bricks();
  const VdvrBrick r = brick_record(v, offsets, b[0], b[1], b[2]);
  const LevelTriple level = v.level[static_cast<std::size_t>((b[2] * n[1] + b[1]) * n[0] + b[0])];
  const float* s = level == LevelTriple{0, 0, 0} ? v.base.data() + r.offset
                                                 : v.tiles.at(level).data() + (r.offset - offsets.at(level));
  return {s, {1, r.stride_y, r.stride_z}, {level[2], level[1], level[0]}};
}

}  // namespace

Seams compare_seams(const MixedVolume& v) {
  const Index3 n = v.bricks();
  const auto offsets = tile_offsets(v);
  Seams out;
  std::mutex lock;
  parallel_for(n[2] * n[1], {}, "seams", [&](std::int64_t row) {
    Seams local;
    for (std::int64_t bx = 0; bx < n[0]; ++bx) {
      const Index3 p{bx, row % n[1], row / n[1]};
      const Stored sp = stored(v, offsets, p);
      // The 13 neighbours after it; the others see this brick as theirs.
      for (int code = 14; code < 27; ++code) {
        const Index3 step{code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1};
        Index3 q{}, count{}, first_p{}, first_q{}, by_p{1, 1, 1}, by_q{1, 1, 1};
        bool exists = true;
        for (std::size_t a = 0; a < 3; ++a) {
          q[a] = p[a] + step[a];
          exists = exists && q[a] >= 0 && q[a] < n[a];
        }
        if (!exists) continue;
        const Stored sq = stored(v, offsets, q);
        for (std::size_t a = 0; a < 3; ++a) {
          const int coarse = std::min(sp.level[a], sq.level[a]);
          const std::int64_t g = v.granularity;
          if (step[a] == 0) count[a] = std::min<std::int64_t>(g, v.grid.cells[a] - p[a] * g) << coarse;
          if (step[a] > 0) first_p[a] = g << sp.level[a];
          if (step[a] < 0) first_q[a] = g << sq.level[a];
          by_p[a] = std::int64_t{1} << (sp.level[a] - coarse);
          by_q[a] = std::int64_t{1} << (sq.level[a] - coarse);
        }
        for (std::int64_t z = 0; z <= count[2]; ++z)
          for (std::int64_t y = 0; y <= count[1]; ++y)
            for (std::int64_t x = 0; x <= count[0]; ++x) {
              const Index3 i{x, y, z};
              std::int64_t at_p = 0, at_q = 0;
              for (std::size_t a = 0; a < 3; ++a) {
                at_p += (first_p[a] + i[a] * by_p[a]) * sp.stride[a];
                at_q += (first_q[a] + i[a] * by_q[a]) * sq.stride[a];
              }
              if (std::bit_cast<std::uint32_t>(sp.samples[at_p]) ==
                  std::bit_cast<std::uint32_t>(sq.samples[at_q]))
                continue;
              if (local.different++ > 0) continue;
              local.bricks = {(p[2] * n[1] + p[1]) * n[0] + p[0], (q[2] * n[1] + q[1]) * n[0] + q[0]};
              for (std::size_t a = 0; a < 3; ++a)
                local.at[a] = v.grid.origin[a] +
                              v.grid.spacing[a] * (static_cast<double>(p[a] * v.granularity) +
                                                   static_cast<double>(first_p[a] + i[a] * by_p[a]) /
                                                       static_cast<double>(std::int64_t{1} << sp.level[a]));
            }
      }
    }
    const std::lock_guard guard(lock);
    if (local.different > 0 && (out.different == 0 || local.bricks < out.bricks)) {
      out.bricks = local.bricks;
      out.at = local.at;
    }
    out.different += local.different;
  });
  return out;
}

}  // namespace vdvr
