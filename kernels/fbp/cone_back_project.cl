// Back-projection of cone-beam views onto columns of z samples: out[y][x][z] = sum_k lambda^-2 q_k(u, v),
// bilinear between the table's columns and rows (FDK; docs/geometry.md, "Cone beam"). Layouts: float
// table[view][column][row], rows contiguous; VdvrConeView views[block][view]; int2 wanted[y][x], the first
// and last sample of a column that anyone wants; float out[y][x][out_stride].
//
// Where the detector stands upright (VDVR_UPRIGHT 1), u and lambda belong to the whole column and v runs
// evenly along it; else each sample has its own. A vector of VDVR_LANES samples reads runs of as many rows,
// one row apart: lane i reads row i of each run, and takes its two rows from those runs in which they are
// its neighbours, because v moves by about a row per sample. Where it moves by more, the runs are more, or
// vectors have one lane. Called by host/fbp/cone_back_project.cpp.
#pragma OPENCL FP_CONTRACT ON

#include "device/lanes.h"
#include "shared/cone_back_project.h"

#ifndef VDVR_UPRIGHT
#error "VDVR_UPRIGHT must be 1 where u and lambda are constant along z, else 0"
#endif
#ifndef VDVR_RUN
#error "VDVR_RUN must be the views of a run"
#endif
// Tuning; never changes the result beyond rounding.
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
#define SHARE(t) fmin(fmax(t, (VEC)(0.0f)), (VEC)(1.0f))

// Linear along the rows of one column of the table: `t` counts rows from `from`, a row further with each
// lane, and lies between 0 and `spans`.
VEC along_rows(__global const float* from, VEC t, int spans) {
  VEC low = RUN(from), value = low;
  for (int j = 1; j <= spans; ++j) {
    const VEC high = RUN(from + j);
    value = fma(SHARE(t - (float)(j - 1)), high - low, value);
    low = high;
  }
  return value;
}

// The same between two columns, which have shares of their own.
VEC between_columns(__global const float* from, int row_stride, float left, float right, VEC t, int spans) {
  __global const float* other = from + row_stride;
  VEC low = fma((VEC)(right), RUN(other), (VEC)(left)*RUN(from)), value = low;
  for (int j = 1; j <= spans; ++j) {
    const VEC high = fma((VEC)(right), RUN(other + j), (VEC)(left)*RUN(from + j));
    value = fma(SHARE(t - (float)(j - 1)), high - low, value);
    low = high;
  }
  return value;
}

// The first row that a vector's lanes read, kept within the table.
int first_row(float lowest, int spans, int rows) { return clamp((int)floor(lowest), 0, rows - 1 - spans); }

// One view's part at the samples z .. z + VDVR_LANES - 1 of a column; d in samples from the block's middle.
VEC view_part(__global const float* table, const VdvrConeView v, float dx, float dy, VEC dz,
              const VdvrConeBand band) {
  const float u_plane = fma(v.step_u[0], dx, v.step_u[1] * dy),
              v_plane = fma(v.step_v[0], dx, v.step_v[1] * dy),
              l_plane = fma(v.step_lambda[0], dx, fma(v.step_lambda[1], dy, v.lambda));
#if VDVR_UPRIGHT
  const float inverse = 1.0f / l_plane, u = fma(u_plane, inverse, v.part_u), cut = floor(u), right = u - cut;
  const VEC row =
      fma(fma((VEC)(v.step_v[2]), dz, (VEC)(v_plane)), (VEC)(inverse), (VEC)(v.part_v)) - LANE_NUMBERS;
  // Even along the column: extremes lie at its ends.
  const float lowest = fmin(FIRST(row), LAST(row)), highest = fmax(FIRST(row), LAST(row));
  const int spans = clamp((int)(floor(highest) - floor(lowest)) + 1, 1, band.spans_v),
            column = clamp((int)v.whole_u + (int)cut, 0, band.columns - 2),
            start = first_row(v.whole_v + lowest, spans, band.rows);
  const VEC t = row - ((float)start - v.whole_v);
  const float weight = inverse * inverse;
  return between_columns(table + (size_t)column * band.row_stride + start, band.row_stride,
                         (1.0f - right) * weight, right * weight, t, spans);
#else
  const VEC inverse = 1.0f / fma((VEC)(v.step_lambda[2]), dz, (VEC)(l_plane)),
            u = fma(fma((VEC)(v.step_u[2]), dz, (VEC)(u_plane)), inverse, (VEC)(v.part_u)),
            row = fma(fma((VEC)(v.step_v[2]), dz, (VEC)(v_plane)), inverse, (VEC)(v.part_v)) - LANE_NUMBERS;
  // u is monotonous along the column; rows bend by less than one between the ends (the launcher sees to it).
  const float bend = VDVR_LANES == 1 ? 0.0f : 1.0f;
  const float lowest = fmin(FIRST(row), LAST(row)) - bend, highest = fmax(FIRST(row), LAST(row)) + bend,
              left = fmin(FIRST(u), LAST(u)), far = fmax(FIRST(u), LAST(u));
  const int spans = clamp((int)(floor(highest) - floor(lowest)) + 1, 1, band.spans_v),
            spans_u = clamp((int)(floor(far) - floor(left)) + 1, 1, band.spans_u),
            column = clamp((int)v.whole_u + (int)floor(left), 0, band.columns - 1 - spans_u),
            start = first_row(v.whole_v + lowest, spans, band.rows);
  const VEC t = row - ((float)start - v.whole_v), s = u - ((float)column - v.whole_u);
  __global const float* from = table + (size_t)column * band.row_stride + start;
  VEC low = along_rows(from, t, spans), value = low;
  for (int i = 1; i <= spans_u; ++i) {
    const VEC high = along_rows(from + (size_t)i * band.row_stride, t, spans);
    value = fma(SHARE(s - (float)(i - 1)), high - low, value);
    low = high;
  }
  return value * inverse * inverse;
#endif
}

__kernel void cone_back_project(__global float* out, __global const float* table,
                                __global const VdvrConeView* views, __global const int2* wanted,
                                VdvrConeBand band) {
  const int z = (int)get_global_id(0) * VDVR_LANES, first_x = (int)get_global_id(1) * VDVR_TILE_X,
            first_y = (int)get_global_id(2) * VDVR_TILE_Y;
  if (z >= band.nz || first_x >= band.nx || first_y >= band.ny) return;
  const int end_x = min(first_x + VDVR_TILE_X, band.nx), end_y = min(first_y + VDVR_TILE_Y, band.ny);
  // Tiles lie within blocks.
  const int block = first_y / VDVR_CONE_BLOCK * band.blocks_x + first_x / VDVR_CONE_BLOCK;
  const float middle_x =
                  (float)(first_x / VDVR_CONE_BLOCK * VDVR_CONE_BLOCK) + 0.5f * (float)(VDVR_CONE_BLOCK - 1),
              middle_y =
                  (float)(first_y / VDVR_CONE_BLOCK * VDVR_CONE_BLOCK) + 0.5f * (float)(VDVR_CONE_BLOCK - 1);
  const VEC dz = ((float)z - 0.5f * (float)(band.nz - 1)) + LANE_NUMBERS;
  __global const VdvrConeView* of_block = views + (size_t)block * band.views;
  VEC totals[VDVR_TILE_X * VDVR_TILE_Y];
  for (int i = 0; i < VDVR_TILE_X * VDVR_TILE_Y; ++i) totals[i] = (VEC)(0.0f);
  for (int run = 0; run < band.views; run += VDVR_RUN) {
    const int end = min(run + VDVR_RUN, band.views);
    for (int y = first_y; y < end_y; ++y)
      for (int x = first_x; x < end_x; ++x) {
        const int2 range = wanted[(size_t)y * band.nx + x];
        if (z > range.y || z + VDVR_LANES - 1 < range.x) continue;
        VEC sum = (VEC)(0.0f);
        __global const float* plane = table + (size_t)run * band.columns * band.row_stride;
        for (int k = run; k < end; ++k, plane += (size_t)band.columns * band.row_stride)
          sum += view_part(plane, of_block[k], (float)x - middle_x, (float)y - middle_y, dz, band);
        totals[(y - first_y) * VDVR_TILE_X + x - first_x] += sum;
      }
  }
  for (int y = first_y; y < end_y; ++y)
    for (int x = first_x; x < end_x; ++x) {
      __global float* to = out + ((size_t)y * band.nx + x) * band.out_stride + z;
      const VEC total = totals[(y - first_y) * VDVR_TILE_X + x - first_x];
      if (band.adds) STORE(LOAD(to) + total, to);
      else STORE(total, to);
    }
}
