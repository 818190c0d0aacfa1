// Samples fitted to the trilinear filter (docs/error-bounds.md, section on coefficients): starting from gold
// at the nodes of a level triple, each step takes from a sample 0.8 of the middle between the largest and the
// smallest error of the interpolant around it, half a sample spacing to every side. Errors count from the
// middle of where F may lie between gold nodes: gold less `curvature` times its second differences. Layouts:
// gold float[block][y + halo][x + halo][gold_stride], node z at z + halo; margin float[block][y + halo][x +
// halo]; a lattice of every spacing-th gold node per axis, `reach` of them in the halo on every side: lattice
// float[block][cy][cx][cz], node n at n / spacing + reach; needed uint[block][cy][cx] and
// wanted uint[block][y + halo][x + halo], a bit for each run of 16 nodes along z, the last for all beyond it;
// along, low and high float[block][cy][cx][gold_stride], gold node z at z + halo. Called by
// host/gold/fit_coefficients.cpp.
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"

inline bool has_run(uint runs, int z) { return runs >> min(z / 16, 31) & 1u; }

// The lattice as gold has it.
__kernel void take_lattice(__global float* lattice, __global const float* gold, __global const uint* needed,
                           VdvrGoldBlocks g, VdvrLattice l) {
  const int z = (int)get_global_id(0), x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / l.cy, y = (int)get_global_id(2) - block * l.cy;
  if (z >= l.cz || x >= l.cx || block >= g.blocks) return;
  const size_t of_lattice = ((size_t)block * l.cy + y) * l.cx + x;
  if (!needed[of_lattice]) return;
  const int gx = (x - l.reach_x) * l.spacing_x + g.halo, gy = (y - l.reach_y) * l.spacing_y + g.halo;
  const size_t column = ((size_t)block * (g.ny + 2 * g.halo) + gy) * (g.nx + 2 * g.halo) + gx;
  lattice[of_lattice * l.cz + z] = gold[column * g.gold_stride + (z - l.reach_z) * l.spacing_z + g.halo];
}

// The lattice interpolated linearly along z at every gold node. One work-item fills one column.
__kernel void interpolate_lattice(__global float* along, __global const float* lattice,
                                  __global const uint* needed, VdvrGoldBlocks g, VdvrLattice l) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1), block = (int)get_global_id(2);
  if (x >= l.cx || y >= l.cy || block >= g.blocks) return;
  const size_t column = ((size_t)block * l.cy + y) * l.cx + x;
  if (!needed[column]) return;
  __global const float* from = lattice + column * l.cz;
  __global float* to = along + column * g.gold_stride + g.halo - l.reach_z * l.spacing_z;
  const float step = 1.0f / (float)l.spacing_z;
  for (int k = 0; k + 1 < l.cz; ++k) {
    const float low = from[k], high = from[k + 1];
    for (int i = 0; i < l.spacing_z; ++i) {
      const float f = (float)i * step;
      to[k * l.spacing_z + i] = (1.0f - f) * low + f * high;
    }
  }
  to[(l.cz - 1) * l.spacing_z] = from[l.cz - 1];
}

// Error of the interpolant at 16 gold nodes along z: errors float[block][y + halo][x + halo][gold_stride].
// Columns with a margin below `lowest` do not count and are left out.
__kernel void lattice_errors(__global float* errors, __global const float* along, __global const float* gold,
                             __global const float* margin, __global const uint* wanted, VdvrGoldBlocks g,
                             VdvrLattice l, float curvature) {
  const int z = (int)get_global_id(0) * 16,
            x = (int)get_global_id(1);  // from the lattice's rim
  const int deep = (l.cy - 1) * l.spacing_y + 1;
  const int block = (int)get_global_id(2) / deep, y = (int)get_global_id(2) - block * deep;
  if (z + 16 > g.gold_stride || x > (l.cx - 1) * l.spacing_x || block >= g.blocks) return;
  const int row = g.nx + 2 * g.halo, gx = x - l.reach_x * l.spacing_x + g.halo,
            gy = y - l.reach_y * l.spacing_y + g.halo;
  const size_t column = ((size_t)block * (g.ny + 2 * g.halo) + gy) * row + gx;
  if (margin[column] < g.lowest || !has_run(wanted[column], z)) return;
  // The last column is no cell's lower end. The halo's outermost columns have no second
  // differences across; they lie outside what is asked for.
  const int ix = min(x / l.spacing_x, l.cx - 2), iy = min(y / l.spacing_y, l.cy - 2);
  const float fx = (float)(x - ix * l.spacing_x) / (float)l.spacing_x,
              fy = (float)(y - iy * l.spacing_y) / (float)l.spacing_y;
  __global const float* a = along + (((size_t)block * l.cy + iy) * l.cx + ix) * g.gold_stride + z;
  __global const float* b = a + (size_t)l.cx * g.gold_stride;
  __global const float* centre = gold + column * g.gold_stride + z;
  const float16 f = vload16(0, centre);
  float16 target = f;
  if (gx > 0 && gy > 0 && gx + 1 < row && gy + 1 < g.ny + 2 * g.halo) {
    const float16 around = vload16(0, centre - 1) + vload16(0, centre + 1) +
                           vload16(0, centre - g.gold_stride) + vload16(0, centre + g.gold_stride) +
                           vload16(0, centre - (size_t)row * g.gold_stride) +
                           vload16(0, centre + (size_t)row * g.gold_stride);
    target = f - curvature * (around - 6.0f * f);
  }
  const float16 e = (1.0f - fy) * ((1.0f - fx) * vload16(0, a) + fx * vload16(0, a + g.gold_stride)) +
                    fy * ((1.0f - fx) * vload16(0, b) + fx * vload16(0, b + g.gold_stride)) - target;
  vstore16(e, 0, errors + column * g.gold_stride + z);
}

// Smallest and largest error over the gold columns within half a spacing of a lattice column, at 16 gold
// nodes along z. Lattice columns on the rim have a cell on one side only, which has to do.
__kernel void pool_errors(__global float* low, __global float* high, __global const float* errors,
                          __global const float* margin, __global const uint* wanted,
                          __global const uint* needed, VdvrGoldBlocks g, VdvrLattice l) {
  const int z = (int)get_global_id(0) * 16, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / l.cy, y = (int)get_global_id(2) - block * l.cy;
  if (z + 16 > g.gold_stride || x >= l.cx || block >= g.blocks) return;
  const size_t of_lattice = ((size_t)block * l.cy + y) * l.cx + x;
  if (!has_run(needed[of_lattice], z)) return;
  float16 smallest = (float16)(INFINITY), largest = (float16)(-INFINITY);
  const int x0 = x > 0 ? -(l.spacing_x / 2) : 0, x1 = x + 1 < l.cx ? l.spacing_x / 2 : 0;
  const int y0 = y > 0 ? -(l.spacing_y / 2) : 0, y1 = y + 1 < l.cy ? l.spacing_y / 2 : 0;
  for (int dy = y0; dy <= y1; ++dy)
    for (int dx = x0; dx <= x1; ++dx) {
      const int gx = (x - l.reach_x) * l.spacing_x + g.halo + dx,
                gy = (y - l.reach_y) * l.spacing_y + g.halo + dy;
      const size_t column = ((size_t)block * (g.ny + 2 * g.halo) + gy) * (g.nx + 2 * g.halo) + gx;
      if (margin[column] < g.lowest || !has_run(wanted[column], z)) continue;
      const float16 e = vload16(0, errors + column * g.gold_stride + z);
      smallest = fmin(smallest, e);
      largest = fmax(largest, e);
    }
  vstore16(smallest, 0, low + of_lattice * g.gold_stride + z);
  vstore16(largest, 0, high + of_lattice * g.gold_stride + z);
}

// One step of the fit. Gold nodes outside [z_first, z_last] do not count, nor those beyond the lattice.
__kernel void shift_lattice(__global float* lattice, __global const float* low, __global const float* high,
                            __global const uint* needed, VdvrGoldBlocks g, VdvrLattice l, float share) {
  const int k = (int)get_global_id(0), x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / l.cy, y = (int)get_global_id(2) - block * l.cy;
  if (k >= l.cz || x >= l.cx || block >= g.blocks) return;
  const size_t column = ((size_t)block * l.cy + y) * l.cx + x;
  if (!needed[column]) return;
  const int centre = (k - l.reach_z) * l.spacing_z;
  const int first = max(k > 0 ? centre - l.spacing_z / 2 : centre, g.z_first),
            last = min(k + 1 < l.cz ? centre + l.spacing_z / 2 : centre, g.z_last);
  float smallest = INFINITY, largest = -INFINITY;
  for (int z = first; z <= last; ++z) {
    smallest = fmin(smallest, low[column * g.gold_stride + z + g.halo]);
    largest = fmax(largest, high[column * g.gold_stride + z + g.halo]);
  }
  if (smallest <= largest) lattice[column * l.cz + k] -= share * 0.5f * (smallest + largest);
}
