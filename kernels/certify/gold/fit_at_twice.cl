// The fit of fit_coefficients.cl where samples are every second gold node of all axes, as those of the base
// are: a step in one pass, without errors and maxima in memory. A step takes from a sample 0.8 of the middle
// between the largest and the smallest of interpolant - target over the 27 nodes around it. Layouts: gold and
// margin as there; targets float[block][y + halo][x + halo][2][stride], first those of the nodes of samples,
// then those of the nodes below them; lattices float[block][cy][cx][stride]; both have sample k at k + 1.
// last int[block][cy][cx]: the last step whose result somebody reads; negative: none. Called by
// host/certify/gold/fit_coefficients.cpp.
#include "device/lanes.h"
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"

#if VDVR_LANES > 8
#error "the columns around a sample are as many registers: eight lanes at most"
#endif

// Two registers' worth of nodes that follow one another, and the halves of every second.
#if VDVR_LANES == 1
#define PAIRS float2
#define READ_PAIRS(p) vload2(0, p)
#define FIRST(v) (v).s0
#define SECOND(v) (v).s1
#elif VDVR_LANES == 4
#define PAIRS float8
#define READ_PAIRS(p) vload8(0, p)
#define FIRST(v) (v).even
#define SECOND(v) (v).odd
#else
#define PAIRS float16
#define READ_PAIRS(p) vload16(0, p)
#define FIRST(v) (v).even
#define SECOND(v) (v).odd
#endif

// Whether a step reads the targets of a column of nodes: one beside a sample's that is fitted.
static inline bool is_fitted_to(__global const int* last, int block, int gx, int gy, VdvrGoldBlocks g,
                                VdvrLattice l) {
  const int from_x = gx - g.halo + 2 * l.reach_x, from_y = gy - g.halo + 2 * l.reach_y;
  for (int y = max(from_y / 2, 0); y <= min((from_y + 1) / 2, l.cy - 1); ++y)
    for (int x = max(from_x / 2, 0); x <= min((from_x + 1) / 2, l.cx - 1); ++x)
      if (last[((size_t)block * l.cy + y) * l.cx + x] >= 0) return true;
  return false;
}

// Gold less `curvature` of its second differences: of VDVR_LANES samples' nodes of a column, and of the nodes
// below them. What has no differences, at the rims of the halo, is gold, or whatever lies beside it: nobody
// asks for those.
__kernel void take_targets(__global float* targets, __global const float* gold, __global const float* margin,
                           __global const int* last, VdvrGoldBlocks g, VdvrLattice l, int stride,
                           float curvature) {
  const int k = (int)get_global_id(0) * VDVR_LANES, gx = (int)get_global_id(1);
  const int row = g.nx + 2 * g.halo, deep = g.ny + 2 * g.halo;
  const int block = (int)get_global_id(2) / deep, gy = (int)get_global_id(2) - block * deep;
  if (k >= l.cz || gx >= row || block >= g.blocks) return;
  const size_t column = ((size_t)block * deep + gy) * row + gx;
  const int of_sample = 2 * (k - l.reach_z);
  if (margin[column] < g.lowest || of_sample + 2 * VDVR_LANES <= g.z_first || of_sample - 1 > g.z_last ||
      !is_fitted_to(last, block, gx, gy, g, l))
    return;
  __global float* to = targets + column * 2 * stride + k + 1;
  // The node below the first sample.
  __global const float* c = gold + column * g.gold_stride + of_sample + g.halo - 1;
  if (gx == 0 || gy == 0 || gx + 1 == row || gy + 1 == deep) {
    for (int i = 0; i < VDVR_LANES && k + i < l.cz; ++i) {
      to[i] = c[2 * i + 1];
      to[stride + i] = c[2 * i + 1];
    }
    return;
  }
  const int to_y = row * g.gold_stride;
  const PAIRS f = READ_PAIRS(c),
              around = READ_PAIRS(c - 1) + READ_PAIRS(c + 1) + READ_PAIRS(c - g.gold_stride) +
                       READ_PAIRS(c + g.gold_stride) + READ_PAIRS(c - to_y) + READ_PAIRS(c + to_y),
              target = fma((PAIRS)(-curvature), fma((PAIRS)(-6.0f), f, around), f);
  WRITE(SECOND(target), to);
  WRITE(FIRST(target), to + stride);
}

// The lattice as gold has it.
__kernel void take_samples(__global float* lattice, __global const float* gold, VdvrGoldBlocks g,
                           VdvrLattice l, int stride) {
  const int k = (int)get_global_id(0), x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / l.cy, y = (int)get_global_id(2) - block * l.cy;
  if (k >= l.cz || x >= l.cx || block >= g.blocks) return;
  const size_t of_lattice = ((size_t)block * l.cy + y) * l.cx + x;
  const int gx = 2 * (x - l.reach_x) + g.halo, gy = 2 * (y - l.reach_y) + g.halo;
  const size_t column = ((size_t)block * (g.ny + 2 * g.halo) + gy) * (g.nx + 2 * g.halo) + gx;
  lattice[of_lattice * stride + k + 1] = gold[column * g.gold_stride + 2 * (k - l.reach_z) + g.halo];
}

// Samples to where the other levels have them.
__kernel void give_samples(__global float* out, __global const float* lattice, VdvrGoldBlocks g,
                           VdvrLattice l, int stride) {
  const int k = (int)get_global_id(0), x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / l.cy, y = (int)get_global_id(2) - block * l.cy;
  if (k >= l.cz || x >= l.cx || block >= g.blocks) return;
  const size_t of_lattice = ((size_t)block * l.cy + y) * l.cx + x;
  out[of_lattice * l.cz + k] = lattice[of_lattice * stride + k + 1];
}

#define HALF(a, b) fma((VEC)(0.5f), (a), 0.5f * (b))
// Smallest and largest error so far, of a column of gold nodes that counts.
#define ERROR(counts, interpolant, at)      \
  if (counts) {                             \
    const VEC e = (interpolant)-READ(at);   \
    smallest = e < smallest ? e : smallest; \
    largest = e > largest ? e : largest;    \
  }

// The nine columns of nodes around a sample's, at heights for which `nw` .. `se` are the lattice interpolated
// along z: rows north (y - 1), middle, south; columns west (x - 1), middle, east. Along x first, as
// lattice_errors does.
#define POOL(at)                                                                          \
  {                                                                                       \
    const VEC n0 = HALF(nw, nm), n1 = HALF(nm, ne), m0 = HALF(mw, mm), m1 = HALF(mm, me); \
    const VEC s0 = HALF(sw, sm), s1 = HALF(sm, se);                                       \
    ERROR(counts_nw, HALF(n0, m0), (at)-to_y - to_x)                                      \
    ERROR(counts_nm, HALF(nm, mm), (at)-to_y)                                             \
    ERROR(counts_ne, HALF(n1, m1), (at)-to_y + to_x)                                      \
    ERROR(counts_mw, m0, (at)-to_x)                                                       \
    ERROR(counts_mm, mm, (at))                                                            \
    ERROR(counts_me, m1, (at) + to_x)                                                     \
    ERROR(counts_sw, HALF(m0, s0), (at) + to_y - to_x)                                    \
    ERROR(counts_sm, HALF(mm, sm), (at) + to_y)                                           \
    ERROR(counts_se, HALF(m1, s1), (at) + to_y + to_x)                                    \
  }
#define FOR_COLUMNS(M)       \
  M(nw, -to_north - to_west) \
  M(nm, -to_north)           \
  M(ne, -to_north + to_east) \
  M(mw, -to_west)            \
  M(mm, 0)                   \
  M(me, to_east)             \
  M(sw, to_south - to_west)  \
  M(sm, to_south)            \
  M(se, to_south + to_east)
#define AT_SAMPLE(name, to) const VEC name = READ(c + (to));
#define BELOW(name, to) const VEC name = HALF(READ(c + (to)-1), READ(c + (to)));
#define ABOVE(name, to) const VEC name = HALF(READ(c + (to)), READ(c + (to) + 1));
// Pools at one of these heights, where it counts.
#define POOL_AT(WHICH, at, counts)                            \
  {                                                           \
    VEC smallest = unlimited, largest = -unlimited;           \
    FOR_COLUMNS(WHICH)                                        \
    POOL(at)                                                  \
    least = fmin(least, select(unlimited, smallest, counts)); \
    most = fmax(most, select(-unlimited, largest, counts));   \
  }

// One step: VDVR_LANES samples of a column. Gold nodes outside [z_first, z_last] do not count, nor those
// beyond the lattice.
__kernel void fit_step(__global float* out, __global const float* lattice, __global const float* targets,
                       __global const float* margin, __global const int* last, VdvrGoldBlocks g,
                       VdvrLattice l, int stride, int step, float share) {
  const int k = (int)get_global_id(0) * VDVR_LANES, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / l.cy, y = (int)get_global_id(2) - block * l.cy;
  if (k >= l.cz || x >= l.cx || block >= g.blocks) return;
  const size_t column = ((size_t)block * l.cy + y) * l.cx + x;
  if (last[column] < step) return;
  __global const float* c = lattice + column * stride + k + 1;
  // Beyond what is tested samples stay what gold is.
  const int lowest = 2 * (k - l.reach_z) - 1, highest = lowest + 2 * VDVR_LANES;
  if (highest < g.z_first || lowest > g.z_last) {
    WRITE(READ(c), out + column * stride + k + 1);
    return;
  }
  const INT sample = k + INDEX, node = 2 * (sample - l.reach_z);
  const INT at_node = (node >= g.z_first) & (node <= g.z_last) & (sample < l.cz),
            at_below = (node - 1 >= g.z_first) & (node - 1 <= g.z_last) & (sample > 0) & (sample < l.cz),
            at_above = (node + 1 >= g.z_first) & (node + 1 <= g.z_last) & (sample + 1 < l.cz);
  const int row = g.nx + 2 * g.halo, gx = 2 * (x - l.reach_x) + g.halo, gy = 2 * (y - l.reach_y) + g.halo;
  const size_t of_gold = ((size_t)block * (g.ny + 2 * g.halo) + gy) * row + gx;
  const int west = x > 0, east = x + 1 < l.cx, north = y > 0, south = y + 1 < l.cy;
  __global const float* m = margin + of_gold;
  const int counts_mm = m[0] >= g.lowest, counts_mw = west && m[-1] >= g.lowest,
            counts_me = east && m[1] >= g.lowest, counts_nm = north && m[-row] >= g.lowest,
            counts_sm = south && m[row] >= g.lowest, counts_nw = north && west && m[-row - 1] >= g.lowest,
            counts_ne = north && east && m[-row + 1] >= g.lowest,
            counts_sw = south && west && m[row - 1] >= g.lowest,
            counts_se = south && east && m[row + 1] >= g.lowest;
  // A neighbour that is not there is not counted either.
  const long to_west = west ? stride : 0, to_east = east ? stride : 0,
             to_north = north ? (long)l.cx * stride : 0, to_south = south ? (long)l.cx * stride : 0;
  __global const float* t = targets + of_gold * 2 * stride + k + 1;
  const long to_x = 2 * stride, to_y = (long)row * 2 * stride;
  const VEC unlimited = (VEC)(INFINITY);
  VEC least = unlimited, most = -unlimited;
  POOL_AT(AT_SAMPLE, t, at_node)
  POOL_AT(BELOW, t + stride, at_below)
  POOL_AT(ABOVE, t + stride + 1, at_above)
  const VEC old = READ(c), moved = fma((VEC)(-(share * 0.5f)), least + most, old);
  WRITE(select(old, moved, least <= most), out + column * stride + k + 1);
}
