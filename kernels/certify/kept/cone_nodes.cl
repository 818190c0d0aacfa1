// Kept nodes of cone beam: out[tile][y][x][height] += sum_k lambda^-2 q_k(u, v), by eight taps both ways from
// tables of six values a pixel (docs/error-bounds.md, section 16). Layouts: float table[view][column][row];
// ConeView views[tile][block][view]; int4 wanted[tile][y]: first and last column of nodes, the first height
// and the one after the last. Places are in columns and rows of the table, relative to the middle of a block
// of nodes. Neighbours in y, which read the same columns and rows, follow one another. Of upright detectors,
// in double precision, values are those of cone_runs.cl to the bit. Called by
// host/certify/kept/cone_tiles.cpp.
#include "device/cone_taps.h"
#include "device/lanes.h"
#include "shared/cone_nodes.h"

// What a view adds at one height: eight columns of eight rows, by weights along u, then along v.
#define COLUMN(j) vload8(0, from + (size_t)(j)*column_stride)
#define ADD(n)                                                                     \
  {                                                                                \
    __global const float* from = from_column + clamp(LANE(row, n), 0, s.last_row); \
    WEIGH_COLUMNS(float8, weight_u, COLUMN)                                        \
    sum##n = fma(taps(LANE(g_v, n)), left + right, sum##n);                        \
  }

#if VDVR_LANES > 8
#error "each height has eight sums: eight lanes at most"
#endif
#define BEGIN(n) float total##n = 0.0f;
#define CLEAR(n) float8 sum##n = (float8)(0.0f);
#define FOLD(n) total##n += sum_of(sum##n);
#define PUT(n) to[n] += total##n;

__kernel void cone_nodes(__global float* out, __global const float* table, __global const ConeView* views,
                         __global const int4* wanted, ulong first, VdvrConeNodes s) {
  const int y = (int)get_global_id(0), height = (int)get_global_id(1) * VDVR_LANES,
            tile = (int)get_global_id(2), group = height / VDVR_CONE_HEIGHTS;
  if (y >= VDVR_CONE_TILE || group >= s.groups || tile >= s.tiles) return;
  const int4 range = wanted[tile * VDVR_CONE_TILE + y];
  const int column_stride = s.column_stride, views_all = s.views, block_z = group / s.block_groups,
            block_y = y / s.block_side;
  const float half_side = 0.5f * (float)(s.block_side - 1),
              half_height = 0.5f * (float)(s.block_groups * VDVR_CONE_HEIGHTS - 1);
  const REAL dy = (REAL)((float)(y - block_y * s.block_side) - half_side);
#if VDVR_DOUBLE  // heights of eight as floats about their middle
  const int run = height / VDVR_CONE_RUN * VDVR_CONE_RUN,
            eight = height / VDVR_CONE_HEIGHTS * VDVR_CONE_HEIGHTS;
  const double dz = (double)((float)run - half_height), to_middle = (double)((float)(eight - run) + 3.5f);
  const VEC from_middle = TO_VEC(height - eight + INDEX) - 3.5f;
#else
  const SUM dz = WIDE(TO_VEC(height - block_z * s.block_groups * VDVR_CONE_HEIGHTS + INDEX) - half_height);
#endif
  for (int x = range.x; x <= range.y; ++x) {
    const int block_x = x / s.block_side;
    const REAL dx = (REAL)((float)(x - block_x * s.block_side) - half_side);
    __global const ConeView* v =
        views + ((size_t)tile * s.blocks + (size_t)(block_z * s.blocks_across + block_y) * s.blocks_across +
                 block_x) *
                    views_all;
    __global const float* plane = table;
    FOR_LANES(BEGIN)
    for (int first_view = 0; first_view < views_all; first_view += VDVR_CONE_VIEWS) {
      FOR_LANES(CLEAR)
      for (int k = first_view; k < min(first_view + VDVR_CONE_VIEWS, views_all); ++k, ++v, plane += s.plane) {
        const REAL l_plane = fma(v->step_lambda[0], dx, v->step_lambda[1] * dy) + v->lambda,
                   u_plane = fma(v->step_u[0], dx, v->step_u[1] * dy),
                   v_plane = fma(v->step_v[0], dx, v->step_v[1] * dy);
        const REAL inverse = (REAL)1 / l_plane, u = fma(u_plane, inverse, v->part_u), whole_u = floor(u);
        const int column = (int)v->whole_u + (int)whole_u - 3;
        const float8 weight_u = (float)(inverse * inverse) * taps((float)(u - whole_u - 0.5f));
        __global const float* from_column = plane + (size_t)clamp(column, 0, s.last_column) * column_stride;
#if VDVR_DOUBLE  // heights of eight as floats about their middle
        const double slope = v->step_v[2] * inverse,
                     lowest = fma(fma(v->step_v[2], dz, v_plane), inverse, v->part_v) - 0.5f,
                     middle = fma(slope, to_middle, lowest);
        const int cut = (int)middle;
        const VEC place = fma((VEC)((float)slope), from_middle, (VEC)((float)(middle - (double)cut))),
                  nearest = (place + TO_WHOLE) - TO_WHOLE, g_v = place - nearest;
        const INT row = (int)v->whole_v + cut + TO_INT(nearest) - 3;
#else
        const SUM v8 = fma(fma((SUM)(v->step_v[2]), dz, (SUM)(v_plane)), (SUM)(inverse), (SUM)(v->part_v)),
                  whole_v = floor(v8);
        const INT row = (int)v->whole_v + TO_INT(whole_v) - 3;
        const VEC g_v = NARROW(v8 - whole_v - 0.5f);
#endif
        FOR_LANES(ADD)
      }
      FOR_LANES(FOLD)
    }
    __global float* to =
        out + first + (size_t)tile * s.tile + ((size_t)y * VDVR_CONE_TILE + x) * s.stride + height;
    FOR_LANES(PUT)
  }
}
