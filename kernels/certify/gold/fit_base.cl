// Base samples fitted to the trilinear filter (docs/error-bounds.md, section 13): every second node of gold
// along all axes. Layouts: gold float[block][y + halo][x + halo][gold_stride], node z at z + halo; margin
// float[block][y + halo][x + halo]; targets float[block][y + halo][x + halo][2][stride], first those of the
// nodes of samples, then those of the nodes below them; lattices float[block][cy][cx][stride]; both have
// sample k at k + 1. last int[block][cy][cx]: the last step whose result somebody reads; negative: none.
// Called by host/certify/gold/fit_base.cpp.
#include "device/lanes.h"
#include "device/fit_sample.h"
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"

#if VDVR_LANES > 8
#error "the columns around a sample are as many registers: eight lanes at most"
#endif

// Two registers' worth of nodes that follow one another, and the halves of every second.
#if VDVR_LANES == 1
#define PAIRS float2
#define FIRST(v) (v).s0
#define SECOND(v) (v).s1
#elif VDVR_LANES == 4
#define PAIRS float8
#define FIRST(v) (v).even
#define SECOND(v) (v).odd
#else
#define PAIRS float16
#define FIRST(v) (v).even
#define SECOND(v) (v).odd
#endif

typedef PAIRS __attribute__((aligned(4))) LOOSE_PAIRS;
#define READ_PAIRS(p) (*(__global const LOOSE_PAIRS*)(p))

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
// below them, up to the one above the last sample; NaN where the field is not tested. What has no
// differences, at the rims of the halo, is gold, or whatever lies beside it: nobody asks for those.
__kernel void take_targets(__global float* targets, __global const float* gold, __global const float* margin,
                           __global const int* last, VdvrGoldBlocks g, VdvrLattice l, int stride,
                           float curvature) {
  const int k = (int)get_global_id(0) * VDVR_LANES, gx = (int)get_global_id(1);
  const int row = g.nx + 2 * g.halo, deep = g.ny + 2 * g.halo;
  const int block = (int)get_global_id(2) / deep, gy = (int)get_global_id(2) - block * deep;
  if (k > l.cz || gx >= row || block >= g.blocks || !is_fitted_to(last, block, gx, gy, g, l)) return;
  const size_t column = ((size_t)block * deep + gy) * row + gx;
  __global float* to = targets + column * 2 * stride + k + 1;
  const VEC none = (VEC)(NAN);
  VEC at_sample = none, below = none;
  const int of_sample = 2 * (k - l.reach_z);
  if (margin[column] >= g.lowest && of_sample + 2 * VDVR_LANES > g.z_first && of_sample - 1 <= g.z_last) {
    // The node below the first sample.
    __global const float* c = gold + column * g.gold_stride + of_sample + g.halo - 1;
    const PAIRS f = READ_PAIRS(c);
    PAIRS target = f;
    if (gx > 0 && gy > 0 && gx + 1 < row && gy + 1 < deep) {
      const int to_y = row * g.gold_stride;
      const PAIRS around = READ_PAIRS(c - 1) + READ_PAIRS(c + 1) + READ_PAIRS(c - g.gold_stride) +
                           READ_PAIRS(c + g.gold_stride) + READ_PAIRS(c - to_y) + READ_PAIRS(c + to_y);
      target = fma((PAIRS)(-curvature), fma((PAIRS)(-6.0f), f, around), f);
    }
    const INT sample = k + INDEX, node = of_sample + 2 * INDEX;
    at_sample = select(none, SECOND(target), (node >= g.z_first) & (node <= g.z_last) & (sample < l.cz));
    below = select(none, FIRST(target),
                   (node > g.z_first) & (node - 1 <= g.z_last) & (sample > 0) & (sample < l.cz));
  }
  WRITE(at_sample, to);
  WRITE(below, to + stride);
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

// One step: VDVR_LANES samples of a column. Where nothing near is tested, or no later step reads it, a sample
// stays what it is.
__kernel void fit_step(__global float* out, __global const float* lattice, __global const float* targets,
                       __global const int* last, VdvrGoldBlocks g, VdvrLattice l, int stride, int step,
                       float share) {
  const int k = (int)get_global_id(0) * VDVR_LANES, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / l.cy, y = (int)get_global_id(2) - block * l.cy;
  if (k >= l.cz || x >= l.cx || block >= g.blocks) return;
  const size_t column = ((size_t)block * l.cy + y) * l.cx + x;
  if (last[column] < step) return;
  __global const float* c = lattice + column * stride + k + 1;
  __global float* to = out + column * stride + k + 1;
  const int lowest = 2 * (k - l.reach_z) - 1, highest = lowest + 2 * VDVR_LANES;
  if (highest < g.z_first || lowest > g.z_last) {
    WRITE(READ(c), to);
    return;
  }
  const int row = g.nx + 2 * g.halo, gx = 2 * (x - l.reach_x) + g.halo, gy = 2 * (y - l.reach_y) + g.halo;
  const size_t of_gold = ((size_t)block * (g.ny + 2 * g.halo) + gy) * row + gx;
  const VdvrAround around = {x > 0,      x + 1 < l.cx,     y > 0, y + 1 < l.cy, stride, l.cx * stride,
                             2 * stride, row * 2 * stride, stride};
  WRITE(fitted(c, targets + of_gold * 2 * stride + k + 1, around, share), to);
}
