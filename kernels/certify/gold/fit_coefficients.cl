// Samples fitted to the trilinear filter (docs/error-bounds.md, section on coefficients): starting from gold
// at the nodes of a level triple, each step takes from a sample 0.8 of the middle between the largest and the
// smallest error of the interpolant around it, half a sample spacing to every side. Errors count from the
// middle of where F may lie between gold nodes: gold less `curvature` times its second differences. Layouts:
// gold float[block][y + halo][x + halo][gold_stride], node z at z + halo; margin float[block][y + halo][x +
// halo]; a lattice of every spacing-th gold node per axis, `reach` of them in the halo on every side: lattice
// float[block][cy][cx][cz], node n at n / spacing + reach; needed uint[block][cy][cx] and
// wanted uint[block][y + halo][x + halo], a bit for each run of 16 nodes along z, the last for all beyond it;
// the columns of either that have a bit, one behind the other: columns of gold or of the lattice, whose x and
// y are those of that array (most bricks of a block do not want what others want, and a work-item that finds
// nothing to do costs as much as three that do);
// along, low and high float[block][cy][cx][gold_stride], gold node z at z + halo. Called by
// host/certify/gold/fit_coefficients.cpp.
#include "device/lanes.h"
#include "device/powers.h"
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"

static inline bool has_run(uint runs, int z) { return runs >> min(z / 16, 31) & 1u; }

// Samples `first` to `end` of a column of the lattice, and what lies above them up to the next: a
// work-item's, which does `each` of them.
typedef struct {
  int x, y, block, first, end;
  size_t column;
} Part;
static inline bool find_part(Part* p, __global const VdvrMarkedColumn* columns, int count, int each,
                             VdvrLattice l) {
  const int i = (int)get_global_id(1);
  p->first = (int)get_global_id(0) * each;
  p->end = min(p->first + each, l.cz);
  if (p->first >= l.cz || i >= count) return false;
  p->x = columns[i].x;
  p->y = columns[i].y;
  p->block = columns[i].block;
  p->column = ((size_t)p->block * l.cy + p->y) * l.cx + p->x;
  return true;
}

// The samples VALUE(k), interpolated linearly along z at every gold node.
#define INTERPOLATE(VALUE)                                                                    \
  {                                                                                           \
    __global float* to = along + p.column * g.gold_stride + g.halo - l.reach_z * l.spacing_z; \
    const float step = inverse_of_power(l.spacing_z);                                         \
    float low = VALUE(p.first);                                                               \
    for (int k = p.first; k < p.end; ++k) {                                                   \
      KEEP(k, low)                                                                            \
      if (k + 1 == l.cz) {                                                                    \
        to[k * l.spacing_z] = low;                                                            \
        break;                                                                                \
      }                                                                                       \
      const float high = VALUE(k + 1);                                                        \
      for (int i = 0; i < l.spacing_z; ++i) {                                                 \
        const float f = (float)i * step;                                                      \
        to[k * l.spacing_z + i] = fma(1.0f - f, low, f * high);                               \
      }                                                                                       \
      low = high;                                                                             \
    }                                                                                         \
  }

// The lattice as gold has it, interpolated.
#define KEEP(k, value) samples[k] = value;
__kernel void take_lattice(__global float* along, __global float* lattice, __global const float* gold,
                           __global const VdvrMarkedColumn* columns, int count, int each, VdvrGoldBlocks g,
                           VdvrLattice l) {
  Part p;
  if (!find_part(&p, columns, count, each, l)) return;
  const int gx = (p.x - l.reach_x) * l.spacing_x + g.halo, gy = (p.y - l.reach_y) * l.spacing_y + g.halo;
  const size_t column = ((size_t)p.block * (g.ny + 2 * g.halo) + gy) * (g.nx + 2 * g.halo) + gx;
  __global const float* from = gold + column * g.gold_stride + g.halo - l.reach_z * l.spacing_z;
  __global float* samples = lattice + p.column * l.cz;
#define OF_GOLD(k) from[(k)*l.spacing_z]
  INTERPOLATE(OF_GOLD)
}

// Smallest and largest error over the gold columns within half a spacing of a lattice column, at
// VDVR_LANES gold nodes along z. Lattice columns on the rim have a cell on one side only, which has to do.
static inline void pool(__global float* low, __global float* high, __global const float* errors,
                        __global const float* margin, __global const uint* wanted, VdvrMarkedColumn at, int z,
                        VdvrGoldBlocks g, VdvrLattice l) {
  if (!has_run(at.runs, z)) return;
  const size_t of_lattice = ((size_t)at.block * l.cy + at.y) * l.cx + at.x;
  VEC smallest = (VEC)(INFINITY), largest = (VEC)(-INFINITY);
  const int x0 = at.x > 0 ? -(l.spacing_x / 2) : 0, x1 = at.x + 1 < l.cx ? l.spacing_x / 2 : 0;
  const int y0 = at.y > 0 ? -(l.spacing_y / 2) : 0, y1 = at.y + 1 < l.cy ? l.spacing_y / 2 : 0;
  for (int dy = y0; dy <= y1; ++dy)
    for (int dx = x0; dx <= x1; ++dx) {
      const int gx = (at.x - l.reach_x) * l.spacing_x + g.halo + dx,
                gy = (at.y - l.reach_y) * l.spacing_y + g.halo + dy;
      const size_t column = ((size_t)at.block * (g.ny + 2 * g.halo) + gy) * (g.nx + 2 * g.halo) + gx;
      if (margin[column] < g.lowest || !has_run(wanted[column], z)) continue;
      const VEC e = READ(errors + column * g.gold_stride + z);
      smallest = fmin(smallest, e);
      largest = fmax(largest, e);
    }
  WRITE(smallest, low + of_lattice * g.gold_stride + z);
  WRITE(largest, high + of_lattice * g.gold_stride + z);
}
__kernel void pool_errors(__global float* low, __global float* high, __global const float* errors,
                          __global const float* margin, __global const uint* wanted,
                          __global const VdvrMarkedColumn* columns, int count, VdvrGoldBlocks g,
                          VdvrLattice l) {
  const int z = (int)get_global_id(0) * VDVR_LANES, i = (int)get_global_id(1);
  if (z + VDVR_LANES > g.gold_stride || i >= count) return;
  pool(low, high, errors, margin, wanted, columns[i], z, g, l);
}

// One step of the fit, interpolated. Gold nodes outside [z_first, z_last] do not count, nor those beyond the
// lattice.
static inline float shifted(int k, __global const float* before, __global const float* low,
                            __global const float* high, VdvrGoldBlocks g, VdvrLattice l, float share) {
  const int centre = (k - l.reach_z) * l.spacing_z;
  const int first = max(k > 0 ? centre - l.spacing_z / 2 : centre, g.z_first),
            last = min(k + 1 < l.cz ? centre + l.spacing_z / 2 : centre, g.z_last);
  float smallest = INFINITY, largest = -INFINITY;
  for (int z = first; z <= last; ++z) {
    smallest = fmin(smallest, low[z + g.halo]);
    largest = fmax(largest, high[z + g.halo]);
  }
  const float sample = before[k];
  return smallest <= largest ? fma(-(share * 0.5f), smallest + largest, sample) : sample;
}
__kernel void shift_lattice(__global float* along, __global float* after, __global const float* before,
                            __global const float* low, __global const float* high,
                            __global const VdvrMarkedColumn* columns, int count, int each, VdvrGoldBlocks g,
                            VdvrLattice l, float share) {
  Part p;
  if (!find_part(&p, columns, count, each, l)) return;
  __global const float *from = before + p.column * l.cz, *least = low + p.column * g.gold_stride,
                       *most = high + p.column * g.gold_stride;
  __global float* samples = after + p.column * l.cz;
#define SHIFTED(k) shifted(k, from, least, most, g, l, share)
  INTERPOLATE(SHIFTED)
}
// Both, where a work-item does a whole column, which needs nobody else's errors: half as many launches.
__kernel void pool_and_shift(__global float* along, __global float* after, __global const float* before,
                             __global float* low, __global float* high, __global const float* errors,
                             __global const float* margin, __global const uint* wanted,
                             __global const VdvrMarkedColumn* columns, int count, VdvrGoldBlocks g,
                             VdvrLattice l, float share) {
  Part p;
  if (!find_part(&p, columns, count, l.cz, l)) return;
  const VdvrMarkedColumn at = columns[get_global_id(1)];
  for (int z = 0; z + VDVR_LANES <= g.gold_stride; z += VDVR_LANES)
    pool(low, high, errors, margin, wanted, at, z, g, l);
  __global const float *from = before + p.column * l.cz, *least = low + p.column * g.gold_stride,
                       *most = high + p.column * g.gold_stride;
  __global float* samples = after + p.column * l.cz;
  INTERPOLATE(SHIFTED)
}
#undef KEEP

// The lattice as it is, interpolated.
#define KEEP(k, value)
__kernel void interpolate_lattice(__global float* along, __global const float* lattice,
                                  __global const VdvrMarkedColumn* columns, int count, int each,
                                  VdvrGoldBlocks g, VdvrLattice l) {
  Part p;
  if (!find_part(&p, columns, count, each, l)) return;
  __global const float* from = lattice + p.column * l.cz;
#define AS_IT_IS(k) from[k]
  INTERPOLATE(AS_IT_IS)
}

// Error of the interpolant at VDVR_LANES gold nodes along z: errors float[block][y + halo][x +
// halo][gold_stride]. Columns with a margin below `lowest` do not count and are left out.
__kernel void lattice_errors(__global float* errors, __global const float* along, __global const float* gold,
                             __global const float* margin, __global const VdvrMarkedColumn* columns,
                             int count, VdvrGoldBlocks g, VdvrLattice l, float curvature) {
  const int z = (int)get_global_id(0) * VDVR_LANES, i = (int)get_global_id(1);
  if (z + VDVR_LANES > g.gold_stride || i >= count || !has_run(columns[i].runs, z)) return;
  const int row = g.nx + 2 * g.halo, gx = columns[i].x, gy = columns[i].y, block = columns[i].block;
  // From the lattice's rim.
  const int x = gx - g.halo + l.reach_x * l.spacing_x, y = gy - g.halo + l.reach_y * l.spacing_y;
  if (x < 0 || y < 0 || x > (l.cx - 1) * l.spacing_x || y > (l.cy - 1) * l.spacing_y) return;
  const size_t column = ((size_t)block * (g.ny + 2 * g.halo) + gy) * row + gx;
  if (margin[column] < g.lowest) return;
  // The last column is no cell's lower end. The halo's outermost nodes have no second differences: what lies
  // beyond them is not gold.
  const int ix = min(x / l.spacing_x, l.cx - 2), iy = min(y / l.spacing_y, l.cy - 2);
  const float fx = (float)(x - ix * l.spacing_x) * inverse_of_power(l.spacing_x),
              fy = (float)(y - iy * l.spacing_y) * inverse_of_power(l.spacing_y);
  __global const float* a = along + (((size_t)block * l.cy + iy) * l.cx + ix) * g.gold_stride + z;
  __global const float* b = a + (size_t)l.cx * g.gold_stride;
  __global const float* centre = gold + column * g.gold_stride + z;
  const VEC f = READ(centre);
  VEC target = f;
  if (gx > 0 && gy > 0 && gx + 1 < row && gy + 1 < g.ny + 2 * g.halo) {
    const VEC around = READ(centre - 1) + READ(centre + 1) + READ(centre - g.gold_stride) +
                       READ(centre + g.gold_stride) + READ(centre - (size_t)row * g.gold_stride) +
                       READ(centre + (size_t)row * g.gold_stride);
    const INT node = z + INDEX;
    target = select(fma((VEC)(-curvature), fma((VEC)(-6.0f), f, around), f), f,
                    (node == 0) | (node >= g.nz + 2 * g.halo - 1));
  }
  const VEC before = (VEC)(1.0f - fx),
            e = fma((VEC)(1.0f - fy), fma(before, READ(a), fx * READ(a + g.gold_stride)),
                    fy * fma(before, READ(b), fx * READ(b + g.gold_stride))) -
                target;
  WRITE(e, errors + column * g.gold_stride + z);
}
