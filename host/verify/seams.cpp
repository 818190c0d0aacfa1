// Compares the samples that neighbouring bricks share.
#include "host/verify/seams.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>

#include "host/base/system/parallel.hpp"
#include "host/volume/brick_layout.hpp"

namespace vdvr {
Seams compare_seams(const MixedVolume& v) {
  const Index3 n = v.bricks();
  Seams out;
  std::mutex lock;
  parallel_for(n[2] * n[1], {}, "seams", [&](std::int64_t row) {
    Seams local;
    for (std::int64_t bx = 0; bx < n[0]; ++bx) {
      const Index3 p{bx, row % n[1], row / n[1]};
      const BrickSamples sp(v, p);
      const std::array<int, 3> level_p = sp.level();
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
        const BrickSamples sq(v, q);
        const std::array<int, 3> level_q = sq.level();
        for (std::size_t a = 0; a < 3; ++a) {
          const int coarse = std::min(level_p[a], level_q[a]);
          const std::int64_t g = v.granularity;
          if (step[a] == 0)
            count[a] = std::min<std::int64_t>(g, v.grid.cells[a] - p[a] * g) << coarse >> v.coarsening[2 - a];
          if (step[a] > 0) first_p[a] = g << level_p[a] >> v.coarsening[2 - a];
          if (step[a] < 0) first_q[a] = g << level_q[a] >> v.coarsening[2 - a];
          by_p[a] = std::int64_t{1} << (level_p[a] - coarse);
          by_q[a] = std::int64_t{1} << (level_q[a] - coarse);
        }
        for (std::int64_t z = 0; z <= count[2]; ++z)
          for (std::int64_t y = 0; y <= count[1]; ++y)
            for (std::int64_t x = 0; x <= count[0]; ++x) {
              const Index3 i{x, y, z};
              Index3 at_p{}, at_q{};
              for (std::size_t a = 0; a < 3; ++a) {
                at_p[a] = first_p[a] + i[a] * by_p[a];
                at_q[a] = first_q[a] + i[a] * by_q[a];
              }
              if (std::bit_cast<std::uint32_t>(sp(at_p[0], at_p[1], at_p[2])) ==
                  std::bit_cast<std::uint32_t>(sq(at_q[0], at_q[1], at_q[2])))
                continue;
              if (local.different++ > 0) continue;
              local.bricks = {(p[2] * n[1] + p[1]) * n[0] + p[0], (q[2] * n[1] + q[1]) * n[0] + q[0]};
              for (std::size_t a = 0; a < 3; ++a)
                local.at[a] =
                    v.grid.origin[a] +
                    v.grid.spacing[a] *
                        (static_cast<double>(p[a] * v.granularity) +
                         std::ldexp(static_cast<double>(first_p[a] + i[a] * by_p[a]), -sp.per_cell()[a]));
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
