// Back-projection of cone-beam views onto columns of z samples: out[y][x][z] = sum_k lambda^-2 q_k(u, v), or
// with lambda^-4, bilinear between the table's columns and rows (FDK; docs/geometry.md, "Cone beam").
// Layouts: float table[view][column][row % VDVR_RATE][row / VDVR_RATE], so that rows a pixel apart follow one
// another; VdvrConeView views[block][view]; int2 wanted[y][x], the first and last sample of a column that
// anyone wants; float out[y][x][out_stride].
//
// Where the detector stands upright (VDVR_UPRIGHT 1), u and lambda belong to the whole column and v runs
// evenly along it; else each sample has its own. A vector of VDVR_LANES samples reads runs of as many rows,
// a pixel apart: lane i reads the i-th row of each run, and takes its two rows from those runs in which they
// are its neighbours, because v moves by about a pixel per sample. Where it moves by more, the runs are more,
// or vectors have one lane. Called by host/field/fdk/cone_back_project.cpp.
#include "device/lanes.h"
#include "shared/cone_back_project.h"

#ifndef VDVR_UPRIGHT
#error "VDVR_UPRIGHT must be 1 where u and lambda are constant along z, else 0"
#endif
#ifndef VDVR_RATE
#error "VDVR_RATE must be the rows of the table to a pixel, a power of two"
#endif
#ifndef VDVR_RUN
#error "VDVR_RUN must be the views of a run"
#endif
#ifndef VDVR_DEPTH_POWER
#error "VDVR_DEPTH_POWER must be 2 for F, or 4 for what is squared of it (its variance)"
#endif
// Tuning; never changes the result beyond rounding.
// Vectors of z per work-item, 1 or 4: they share what belongs to the column.
#ifndef VDVR_VECTORS
#define VDVR_VECTORS 1
#endif
#ifndef VDVR_TILE_X
#define VDVR_TILE_X 4
#endif
#ifndef VDVR_TILE_Y
#define VDVR_TILE_Y 4
#endif

#if VDVR_LANES == 1
#define LANE_NUMBERS 0.0f
#define FIRST(v) (v)
#define LAST(v) (v)
#define RUN(p) (*(p))
#elif VDVR_LANES == 4
#define LANE_NUMBERS (float4)(0, 1, 2, 3)
#define FIRST(v) (v).s0
#define LAST(v) (v).s3
#define RUN(p) vload4(0, p)
#elif VDVR_LANES == 8
#define LANE_NUMBERS (float8)(0, 1, 2, 3, 4, 5, 6, 7)
#define FIRST(v) (v).s0
#define LAST(v) (v).s7
#define RUN(p) vload8(0, p)
#else
#define LANE_NUMBERS (float16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
#define FIRST(v) (v).s0
#define LAST(v) (v).sf
#define RUN(p) vload16(0, p)
#endif
// By comparisons, which compilers make one instruction of; fmin and fmax heed NaN, and floor takes many.
#define ABOVE_0(t) ((t) > 0.0f ? (t) : (VEC)(0.0f))
#define BELOW_1(t) ((t) < 1.0f ? (t) : (VEC)(1.0f))
#define SHARE(t) BELOW_1(ABOVE_0(t))
#define LESS(a, b) ((a) < (b) ? (a) : (b))
#define MORE(a, b) ((a) < (b) ? (b) : (a))
// Where row `row` of a column of the table lies.
#define ROW(column, row, row_stride) \
  ((column) + ((row) & (VDVR_RATE - 1)) * ((row_stride) / VDVR_RATE) + (row) / VDVR_RATE)
#define FLOOR(s) ((int)(s) - ((s) < (float)(int)(s)))
// lambda^-VDVR_DEPTH_POWER times a value.
#if VDVR_DEPTH_POWER == 2
#define AT_DEPTH(value, inverse) ((value) * (inverse) * (inverse))
#elif VDVR_DEPTH_POWER == 4
#define AT_DEPTH(value, inverse) ((value) * ((inverse) * (inverse)) * ((inverse) * (inverse)))
#else
#error "VDVR_DEPTH_POWER is 2 or 4"
#endif
#define INLINE static inline __attribute__((always_inline))

#if VDVR_UPRIGHT
// Of one vector: which row its lanes begin at, how far each lies beyond, and what the rows give.
#define BETWEEN(row) \
  fma((VEC)(right), RUN(ROW(from + row_stride, row, row_stride)), (VEC)(left)*RUN(ROW(from, row, row_stride)))
#define PLACE(i)                                                                            \
  const float first##i = fma(lane_step, (float)(i * VDVR_LANES), first);                    \
  const int start##i = clamp(whole_v + FLOOR(first##i + lowest), 0, last_start);            \
  VEC t##i = fma((VEC)(bend), LANE_NUMBERS, (VEC)(first##i - (float)(start##i - whole_v))), \
      low##i = BETWEEN(start##i), value##i = low##i;
#define STEP(i)                                           \
  {                                                       \
    const VEC high = BETWEEN(start##i + j);               \
    value##i = fma(SHARE(t##i), high - low##i, value##i); \
    t##i -= 1.0f;                                         \
    low##i = high;                                        \
  }
#define ADD(i) sum##i += value##i;
#else
// Linear along the rows of one column of the table: `t` counts rows from `start`, a pixel further with
// each lane, and lies between 0 and `spans`.
INLINE VEC along_rows(__global const float* column, int start, int row_stride, VEC t, int spans) {
  VEC low = RUN(ROW(column, start, row_stride)), value = low;
  for (int j = 1; j <= spans; ++j, t -= 1.0f) {
    const VEC high = RUN(ROW(column, start + j, row_stride));
    value = fma(SHARE(t), high - low, value);
    low = high;
  }
  return value;
}

// One view's part at the samples of a vector, whose middle lies dz samples from the block's.
INLINE VEC view_part(__global const float* table, __global const VdvrConeView* v, float u_plane,
                     float v_plane, float l_plane, VEC dz, int columns, int rows, int row_stride,
                     int most_spans, int most_spans_u) {
  const VEC inverse = 1.0f / fma((VEC)(v->step_lambda[2]), dz, (VEC)(l_plane)),
            u = fma(fma((VEC)(v->step_u[2]), dz, (VEC)(u_plane)), inverse, (VEC)(v->part_u)),
            row = fma(fma((VEC)(v->step_v[2]), dz, (VEC)(v_plane)), inverse, (VEC)(v->part_v)) -
                  (float)VDVR_RATE * LANE_NUMBERS;
  // u is monotonous along the column; rows bend by less than one between the ends (the launcher sees to it).
  const float bend = VDVR_LANES == 1 ? 0.0f : 1.0f;
  const float lowest = LESS(FIRST(row), LAST(row)) - bend, highest = MORE(FIRST(row), LAST(row)) + bend,
              left = LESS(FIRST(u), LAST(u)), far = MORE(FIRST(u), LAST(u));
  const int spans = clamp(FLOOR(highest) - FLOOR(lowest) + 1, 1, most_spans),
            spans_u = clamp(FLOOR(far) - FLOOR(left) + 1, 1, most_spans_u), whole_u = (int)v->whole_u,
            whole_v = (int)v->whole_v, column = clamp(whole_u + FLOOR(left), 0, columns - 1 - spans_u),
            start = clamp(whole_v + FLOOR(lowest), 0, rows - 1 - spans);
  const VEC t = row - (float)(start - whole_v);
  VEC s = u - (float)(column - whole_u);
  __global const float* from = table + (size_t)column * row_stride;
  VEC low = along_rows(from, start, row_stride, t, spans), value = low;
  for (int i = 1; i <= spans_u; ++i, s -= 1.0f) {
    const VEC high = along_rows(from + (size_t)i * row_stride, start, row_stride, t, spans);
    value = fma(SHARE(s), high - low, value);
    low = high;
  }
  return AT_DEPTH(value, inverse);
}
#define PART(i)                                                                                         \
  sum##i += view_part(plane, v, u_plane, v_plane, l_plane, dz + (float)(i * VDVR_LANES), columns, rows, \
                      row_stride, spans_v, spans_u);
#endif

// Named sums, not an array: compilers keep these in registers.
#if VDVR_VECTORS == 4
#define FOR_VECTORS(M) M(0) M(1) M(2) M(3)
#else
#define FOR_VECTORS(M) M(0)
#endif
#define CLEAR(i) VEC sum##i = (VEC)(0.0f);
#define JOIN(i) totals[place + i] += sum##i;
#define PUT(i)                                              \
  if (z + i * VDVR_LANES < nz) {                            \
    __global float* to = target + i * VDVR_LANES;           \
    if (band.adds) STORE(LOAD(to) + totals[place + i], to); \
    else STORE(totals[place + i], to);                      \
  }

__kernel void cone_back_project(__global float* out, __global const float* table,
                                __global const VdvrConeView* views, __global const int2* wanted,
                                VdvrConeBand band) {
  // Copies, which no store can be taken to change.
  const int columns = band.columns, rows = band.rows, row_stride = band.row_stride, views_all = band.views,
            nx = band.nx, nz = band.nz, spans_v = band.spans_v, spans_u = band.spans_u;
  const int z = (int)get_global_id(0) * (VDVR_LANES * VDVR_VECTORS),
            first_x = (int)get_global_id(1) * VDVR_TILE_X, first_y = (int)get_global_id(2) * VDVR_TILE_Y;
  if (z >= nz || first_x >= nx || first_y >= band.ny) return;
  const int end_x = min(first_x + VDVR_TILE_X, nx), end_y = min(first_y + VDVR_TILE_Y, band.ny);
  // Tiles lie within blocks.
  const int block_x = first_x / VDVR_CONE_BLOCK, block_y = first_y / VDVR_CONE_BLOCK;
  const float middle_x = (float)(block_x * VDVR_CONE_BLOCK) + 0.5f * (float)(VDVR_CONE_BLOCK - 1),
              middle_y = (float)(block_y * VDVR_CONE_BLOCK) + 0.5f * (float)(VDVR_CONE_BLOCK - 1),
              above = (float)z - 0.5f * (float)(nz - 1);
  __global const VdvrConeView* of_block = views + (size_t)(block_y * band.blocks_x + block_x) * views_all;
  VEC totals[VDVR_TILE_X * VDVR_TILE_Y * VDVR_VECTORS];
  for (int i = 0; i < VDVR_TILE_X * VDVR_TILE_Y * VDVR_VECTORS; ++i) totals[i] = (VEC)(0.0f);
  for (int run = 0; run < views_all; run += VDVR_RUN) {
    const int end = min(run + VDVR_RUN, views_all);
    for (int y = first_y; y < end_y; ++y)
      for (int x = first_x; x < end_x; ++x) {
        const int2 range = wanted[(size_t)y * nx + x];
        if (z > range.y || z + VDVR_LANES * VDVR_VECTORS - 1 < range.x) continue;
        const float dx = (float)x - middle_x, dy = (float)y - middle_y;
        __global const float* plane = table + (size_t)run * columns * row_stride;
        FOR_VECTORS(CLEAR)
        for (int k = run; k < end; ++k, plane += (size_t)columns * row_stride) {
          __global const VdvrConeView* v = of_block + k;
          const float u_plane = fma(v->step_u[0], dx, v->step_u[1] * dy),
                      v_plane = fma(v->step_v[0], dx, v->step_v[1] * dy),
                      l_plane = fma(v->step_lambda[0], dx, fma(v->step_lambda[1], dy, v->lambda));
#if VDVR_UPRIGHT
          const float inverse = 1.0f / l_plane, u = fma(u_plane, inverse, v->part_u);
          const int cut = FLOOR(u), column = clamp((int)v->whole_u + cut, 0, columns - 2),
                    whole_v = (int)v->whole_v;
          const float lane_step = v->step_v[2] * inverse, bend = lane_step - (float)VDVR_RATE,
                      first = fma(fma(v->step_v[2], above, v_plane), inverse, v->part_v),
                      across = bend * (float)(VDVR_LANES - 1), lowest = LESS(across, 0.0f),
                      weight = AT_DEPTH(1.0f, inverse), right = (u - (float)cut) * weight,
                      left = weight - right;
          const int spans = clamp((int)fabs(across) + 2, 1, spans_v), last_start = rows - 1 - spans;
          __global const float* from = plane + (size_t)column * row_stride;
          FOR_VECTORS(PLACE)
          for (int j = 1; j <= spans; ++j) {
            FOR_VECTORS(STEP)
          }
          FOR_VECTORS(ADD)
#else
          const VEC dz = above + LANE_NUMBERS;
          FOR_VECTORS(PART)
#endif
        }
        const int place = ((y - first_y) * VDVR_TILE_X + x - first_x) * VDVR_VECTORS;
        FOR_VECTORS(JOIN)
      }
  }
  for (int y = first_y; y < end_y; ++y)
    for (int x = first_x; x < end_x; ++x) {
      __global float* target = out + ((size_t)y * nx + x) * band.out_stride + z;
      const int place = ((y - first_y) * VDVR_TILE_X + x - first_x) * VDVR_VECTORS;
      FOR_VECTORS(PUT)
    }
}
