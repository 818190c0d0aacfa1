// Samples fitted to the trilinear filter (docs/error-bounds.md, section on coefficients): starting from gold
// at the nodes of a level, each step takes from a sample 0.8 of the middle between the largest and the
// smallest error of the interpolant around it, half a sample spacing to every side. Errors count from the
// middle of where F may lie between gold nodes: gold less `curvature` times its second differences. Layouts:
// gold float[block][y + halo][x + halo][gold_stride], node z at z + halo; margin float[block][y + halo][x +
// halo]; a lattice of every `spacing`-th gold node, `reach` of them in the halo on every side: lattice
// float[block][cy][cx][lattice_stride], node n at n / spacing + reach; along, low and high
// float[block][cy][cx][gold_stride], gold node z at z + halo. Called by host/fit_coefficients.cpp.

// The lattice as gold has it.
__kernel void take_lattice(__global float* lattice, __global const float* gold, int nx, int ny, int halo,
                           int gold_stride, int spacing, int reach, int cx, int cy, int cz,
                           int lattice_stride, int blocks) {
  const int z = (int)get_global_id(0), x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / cy, y = (int)get_global_id(2) - block * cy;
  if (z >= cz || x >= cx || block >= blocks) return;
  const int gx = (x - reach) * spacing + halo, gy = (y - reach) * spacing + halo;
  const size_t column = ((size_t)block * (ny + 2 * halo) + gy) * (nx + 2 * halo) + gx;
  lattice[(((size_t)block * cy + y) * cx + x) * lattice_stride + z] =
      gold[column * gold_stride + (z - reach) * spacing + halo];
}

// The lattice interpolated linearly along z at every gold node. One work-item fills one column.
__kernel void interpolate_lattice(__global float* along, __global const float* lattice, int halo,
                                  int gold_stride, int spacing, int reach, int cx, int cy, int cz,
                                  int lattice_stride, int blocks) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1), block = (int)get_global_id(2);
  if (x >= cx || y >= cy || block >= blocks) return;
  const size_t column = ((size_t)block * cy + y) * cx + x;
  __global const float* from = lattice + column * lattice_stride;
  __global float* to = along + column * gold_stride + halo - reach * spacing;
  const float step = 1.0f / (float)spacing;
  for (int k = 0; k + 1 < cz; ++k) {
    const float low = from[k], high = from[k + 1];
    for (int i = 0; i < spacing; ++i) {
      const float f = (float)i * step;
      to[k * spacing + i] = (1.0f - f) * low + f * high;
    }
  }
  to[(cz - 1) * spacing] = from[cz - 1];
}

// Error of the interpolant at 16 gold nodes along z: errors float[block][y + halo][x + halo][gold_stride].
// Columns nearer to the rim than half a spacing are left out, and so are those with a margin below `lowest`,
// which do not count.
__kernel void lattice_errors(__global float* errors, __global const float* along, __global const float* gold,
                             __global const float* margin, float lowest, int nx, int ny, int halo,
                             int gold_stride, int spacing, int reach, int cx, int cy, int blocks,
                             float curvature) {
  const int z = (int)get_global_id(0) * 16,
            x = (int)get_global_id(1) + spacing / 2;  // from the lattice's rim
  const int deep = (cy - 1) * spacing + 1 - 2 * (spacing / 2);
  const int block = (int)get_global_id(2) / deep, y = (int)get_global_id(2) - block * deep + spacing / 2;
  if (z + 16 > gold_stride || x > (cx - 1) * spacing - spacing / 2 || block >= blocks) return;
  const int row = nx + 2 * halo, gx = x - reach * spacing + halo, gy = y - reach * spacing + halo;
  const size_t column = ((size_t)block * (ny + 2 * halo) + gy) * row + gx;
  if (margin[column] < lowest) return;
  const int ix = x / spacing, iy = y / spacing;
  const float step = 1.0f / (float)spacing;
  const float fx = (float)(x - ix * spacing) * step, fy = (float)(y - iy * spacing) * step;
  __global const float* a = along + (((size_t)block * cy + iy) * cx + ix) * gold_stride + z;
  __global const float* b = a + (size_t)cx * gold_stride;
  __global const float* centre = gold + column * gold_stride + z;
  const float16 f = vload16(0, centre);
  const float16 around = vload16(0, centre - 1) + vload16(0, centre + 1) + vload16(0, centre - gold_stride) +
                         vload16(0, centre + gold_stride) + vload16(0, centre - (size_t)row * gold_stride) +
                         vload16(0, centre + (size_t)row * gold_stride);
  const float16 e = (1.0f - fy) * ((1.0f - fx) * vload16(0, a) + fx * vload16(0, a + gold_stride)) +
                    fy * ((1.0f - fx) * vload16(0, b) + fx * vload16(0, b + gold_stride)) -
                    (f - curvature * (around - 6.0f * f));
  vstore16(e, 0, errors + column * gold_stride + z);
}

// Smallest and largest error over the gold columns within half a spacing of a lattice column, at 16 gold
// nodes along z. Lattice columns on the rim have no cell on one side: they are left out.
__kernel void pool_errors(__global float* low, __global float* high, __global const float* errors,
                          __global const float* margin, float lowest, int nx, int ny, int halo,
                          int gold_stride, int spacing, int reach, int cx, int cy, int blocks) {
  const int z = (int)get_global_id(0) * 16, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / cy, y = (int)get_global_id(2) - block * cy;
  if (z + 16 > gold_stride || x < 1 || y < 1 || x >= cx - 1 || y >= cy - 1 || block >= blocks) return;
  const int half_spacing = spacing / 2;
  float16 smallest = (float16)(INFINITY), largest = (float16)(-INFINITY);
  for (int dy = -half_spacing; dy <= half_spacing; ++dy)
    for (int dx = -half_spacing; dx <= half_spacing; ++dx) {
      const int gx = (x - reach) * spacing + halo + dx, gy = (y - reach) * spacing + halo + dy;
      const size_t column = ((size_t)block * (ny + 2 * halo) + gy) * (nx + 2 * halo) + gx;
      if (margin[column] < lowest) continue;
      const float16 e = vload16(0, errors + column * gold_stride + z);
      smallest = fmin(smallest, e);
      largest = fmax(largest, e);
    }
  const size_t out = (((size_t)block * cy + y) * cx + x) * gold_stride + z;
  vstore16(smallest, 0, low + out);
  vstore16(largest, 0, high + out);
}

// One step of the fit. Gold nodes outside [z_first, z_last] do not count. The rim of the lattice stays.
__kernel void shift_lattice(__global float* lattice, __global const float* low, __global const float* high,
                            int halo, int gold_stride, int spacing, int reach, int cx, int cy, int cz,
                            int lattice_stride, int blocks, int z_first, int z_last, float share) {
  const int k = (int)get_global_id(0), x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / cy, y = (int)get_global_id(2) - block * cy;
  if (k < 1 || x < 1 || y < 1 || k >= cz - 1 || x >= cx - 1 || y >= cy - 1 || block >= blocks) return;
  const size_t column = ((size_t)block * cy + y) * cx + x;
  const int centre = (k - reach) * spacing;
  const int first = max(centre - spacing / 2, z_first), last = min(centre + spacing / 2, z_last);
  float smallest = INFINITY, largest = -INFINITY;
  for (int z = first; z <= last; ++z) {
    smallest = fmin(smallest, low[column * gold_stride + z + halo]);
    largest = fmax(largest, high[column * gold_stride + z + halo]);
  }
  if (smallest <= largest) lattice[column * lattice_stride + k] -= share * 0.5f * (smallest + largest);
}
