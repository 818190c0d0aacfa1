// Measures the stored field V against gold at every tested node of a block, through the sampler that renders
// it (kernels/shared/mixed_sampler.h). Per brick: the largest that |V - F| may be, from V - gold and from how
// far F may lie above and below gold's interpolant; the largest |V - gold|; the largest slack to either side;
// and which of its 27 parts (corners, edges, faces, inside) hold a node above the tolerance. Layouts as in
// node_slack.cl; results [block][brick z][brick y][brick x]. Called by host/gold/gold_batch.cpp.
#include "device/largest.h"
#include "shared/gold_shape.h"
#include "shared/mixed_sampler.h"
#include "shared/untested.h"

// The part of a closed brick that a node lies on along one axis: 0 low border, 1 inside, 2 high border.
inline int part_of(int i, int last) { return i == 0 ? 0 : (i == last ? 2 : 1); }

// Positive floats order as their bits do. Most columns do not raise the maximum: a plain read spares them the
// atomic.
inline void raise(volatile __global int* target, float v) {
  if (as_int(v) > *target) atomic_max(target, as_int(v));
}

__kernel void measure_nodes(volatile __global int* total, volatile __global int* error,
                            volatile __global int* slack_max, volatile __global int* violated,
                            __global const uchar* samples, __global const uint* bricks, VdvrGrid grid,
                            __global const float* gold, __global const float* above,
                            __global const float* below, __global const float* margin,
                            __global const int4* first_brick, __global const uchar* selected, VdvrGoldShape s,
                            float tolerance) {
  const int g = grid.granularity, side = g * s.rate + 1;
  const int ix = (int)get_global_id(0) % side, brick_x = (int)get_global_id(0) / side;
  const int iy = (int)get_global_id(1) % side, brick_y = (int)get_global_id(1) / side;
  const int block = (int)get_global_id(2);
  if (brick_x >= s.bricks_x || brick_y >= s.bricks_y || block >= s.blocks) return;
  const int4 first = first_brick[block];
  const int bx = first.x + brick_x, by = first.y + brick_y;
  if (bx >= grid.bricks_x || by >= grid.bricks_y) return;
  const int last_x = min(g, grid.cells_x - bx * g) * s.rate, last_y = min(g, grid.cells_y - by * g) * s.rate;
  if (ix > last_x || iy > last_y) return;
  const size_t column = ((size_t)block * s.ny + brick_y * g * s.rate + iy) * s.nx + brick_x * g * s.rate + ix;
  const size_t gold_at =
      ((size_t)block * (s.ny + 2 * s.halo) + brick_y * g * s.rate + iy + s.halo) * (s.nx + 2 * s.halo) +
      brick_x * g * s.rate + ix + s.halo;
  if (margin[gold_at] < s.lowest) return;
  // Gold nodes are dyadic fractions of a cell: these cell coordinates are exact.
  const float cx = (float)(bx * g) + (float)ix / (float)s.rate,
              cy = (float)(by * g) + (float)iy / (float)s.rate;
  __global const float* gold_start = gold + gold_at * s.gold_stride + s.halo;
  __global const float *above_start = above + column * s.stride, *below_start = below + column * s.stride;

  for (int brick_z = 0; brick_z < s.bricks_z; ++brick_z) {
    const int bz = first.z + brick_z;
    const size_t brick = ((size_t)bz * grid.bricks_y + by) * grid.bricks_x + bx;
    if (bz >= grid.bricks_z || !selected[brick]) continue;
    const int last_z = min(g, grid.cells_z - bz * g) * s.rate;
    const VdvrBrick b = vdvr_brick(bricks, grid, brick);
    const VdvrLocal x = vdvr_local(cx, bx, b.level_x, g, grid.cells_x, grid.coarse_x),
                    y = vdvr_local(cy, by, b.level_y, g, grid.cells_y, grid.coarse_y);
    __global const float* gold_column = gold_start + brick_z * g * s.rate;
    __global const float *above_column = above_start + brick_z * g * s.rate,
                         *below_column = below_start + brick_z * g * s.rate;
    const int per_interval = (s.rate << grid.coarse_z) >> b.level_z;
    const float interval = 1.0f / (float)per_interval;
    float largest_total = -1.0f, largest_error = 0.0f, largest_slack = -1.0f;
    int parts = 0;
    // Sample interval by sample interval: its two faces are what vdvr_trilinear interpolates for every node
    // between them, and the nodes' fractions are the dyadic ones vdvr_local gives.
    for (int index = 0; index * per_interval < last_z; ++index) {
      const float low = vdvr_sample_in_plane(samples, b, x, y, index);
      const float high = vdvr_sample_in_plane(samples, b, x, y, index + 1);
      const int first_node = index * per_interval,
                nodes = first_node + per_interval == last_z ? per_interval + 1 : per_interval;
      int i = 0;
      for (; i + 8 <= nodes; i += 8) {
        const float8 t = ((float)i + (float8)(0, 1, 2, 3, 4, 5, 6, 7)) * interval;
        const float8 up = vload8(0, above_column + first_node + i),
                     down = vload8(0, below_column + first_node + i);
        const float8 e = ((1.0f - t) * low + t * high) -
                         vload8(0, gold_column + first_node + i);  // vdvr_lerp, eight at once
        const float8 both = fmax(e + down, up - e);
        // Untested nodes have a slack far below zero: they drop out of every maximum. NaN fails the
        // comparisons, and is looked at below.
        const int8 tested = up != VDVR_UNTESTED;
        if (any(tested & !((up >= 0.0f) & (down >= 0.0f) & (e + down <= tolerance) & (up - e <= tolerance))))
          break;
        largest_total = fmax(largest_total, largest_of_8(both));
        largest_slack = fmax(largest_slack, largest_of_8(fmax(up, down)));
        largest_error = fmax(largest_error, largest_of_8(select((float8)(0.0f), fabs(e), tested)));
      }
      for (; i < nodes; ++i) {
        const int k = first_node + i;
        if (above_column[k] == VDVR_UNTESTED) continue;
        // NaN would drop out of the maxima.
        const float up = above_column[k] >= 0.0f ? above_column[k] : INFINITY,
                    down = below_column[k] >= 0.0f ? below_column[k] : INFINITY;
        const float difference = vdvr_lerp(low, high, (float)i * interval) - gold_column[k],
                    e = isnan(difference) ? INFINITY : difference, both = fmax(e + down, up - e);
        largest_total = fmax(largest_total, both);
        largest_slack = fmax(largest_slack, fmax(up, down));
        largest_error = fmax(largest_error, fabs(e));
        if (!(both <= tolerance))
          parts |= 1 << (part_of(k, last_z) * 9 + part_of(iy, last_y) * 3 + part_of(ix, last_x));
      }
    }
    if (largest_slack < 0.0f) continue;
    const size_t out = (((size_t)block * s.bricks_z + brick_z) * s.bricks_y + brick_y) * s.bricks_x + brick_x;
    raise(total + out, fmax(largest_total, 0.0f));
    raise(error + out, largest_error);
    raise(slack_max + out, largest_slack);
    if (parts) atomic_or(violated + out, parts);
  }
}
