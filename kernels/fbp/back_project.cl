// Back-projection onto columns of z samples: out[block][y][x][z] = sum_k q_k(t_k(x, y), z), the paper's Eq. 2
// with the view weights folded into q. Layouts: float filtered[z / 16][view][column n][16], so that
// neighbouring columns are neighbouring cache lines and no power-of-two stride maps them onto one cache set;
// float out[block][y][x][out_stride]; per block and view a float4 {step of s along x, along y, s in the
// block's middle less the nearest integer, that integer}. One work-item carries VDVR_LANES samples of z for a
// tile of neighbours in x and y: position, index and weights are shared by the whole column, and the loads
// are contiguous. Positions are relative to the block's middle, so fp32 holds them; views are summed in runs
// of VDVR_RUN, whose sums are then added (docs/error-bounds.md, section 7). rows int2[block][y]: the first
// and last column of that row (and of the tile's rows above it) that anyone wants. Called by
// host/fbp/back_project.cpp.
#pragma OPENCL FP_CONTRACT ON

#include "device/lanes.h"
#include "shared/back_project.h"
#include "shared/six_taps.h"

#ifndef VDVR_TAPS
#error "VDVR_TAPS must be 2 (linear in u), 4 (cubic) or 6"
#endif
#ifndef VDVR_RUN
#error "VDVR_RUN must be the views of a run"
#endif
// Tuning; never changes the result.
#ifndef VDVR_TILE
#define VDVR_TILE 8
#endif
// Vectors of z per work-item, 1 or 2: two share weights and positions, at twice the registers.
#ifndef VDVR_VECTORS
#define VDVR_VECTORS 1
#endif

// A tile of 1 or 4 x 2 neighbours; lane i of a TILE value belongs to column i % 4, row i / 4.
#if VDVR_TILE == 8
#define TILE float8
#define ITILE int8
#define TO_ITILE convert_int8
#define TO_TILE convert_float8
#define TILE_X 4
#define TILE_Y 2
#define OFFSET_X (float8)(0, 1, 2, 3, 0, 1, 2, 3)
#define OFFSET_Y (float8)(0, 0, 0, 0, 1, 1, 1, 1)
#define FOR_TILE(M) \
  M(a0, s0, 0, 0)   \
  M(a1, s1, 1, 0)   \
  M(a2, s2, 2, 0) M(a3, s3, 3, 0) M(b0, s4, 0, 1) M(b1, s5, 1, 1) M(b2, s6, 2, 1) M(b3, s7, 3, 1)
#define LANE(v, i) v.i
// -1 where true, as vectors have it.
#define IS_LESS(a, b) ((a) < (b))
#elif VDVR_TILE == 1
#define TILE float
#define ITILE int
#define TO_ITILE convert_int
#define TO_TILE convert_float
#define TILE_X 1
#define TILE_Y 1
#define OFFSET_X 0.0f
#define OFFSET_Y 0.0f
#define FOR_TILE(M) M(a0, s0, 0, 0)
#define LANE(v, i) v
#define IS_LESS(a, b) (-((a) < (b)))
#else
#error "VDVR_TILE is 1 or 8"
#endif

// Into sum_low the column's samples at q, into sum_high those of the vector above.
#if VDVR_VECTORS == 2
#define INTO(sum, w, q)                          \
  sum##_low = fma((VEC)(w), LOAD(q), sum##_low); \
  sum##_high = fma((VEC)(w), LOAD(q + above), sum##_high);
#else
#define INTO(sum, w, q) sum##_low = fma((VEC)(w), LOAD(q), sum##_low);
#endif
#if VDVR_TAPS == 6
#define ADD(sum, i, c, r)                          \
  {                                                \
    __global const float* q = plane + LANE(at, i); \
    INTO(sum, LANE(w0, i), q)                      \
    INTO(sum, LANE(w1, i), q + 16)                 \
    INTO(sum, LANE(w2, i), q + 32)                 \
    INTO(sum, LANE(w3, i), q + 48)                 \
    INTO(sum, LANE(w4, i), q + 64)                 \
    INTO(sum, LANE(w5, i), q + 80)                 \
  }
#elif VDVR_TAPS == 4
#define ADD(sum, i, c, r)                          \
  {                                                \
    __global const float* q = plane + LANE(at, i); \
    INTO(sum, LANE(w0, i), q)                      \
    INTO(sum, LANE(w1, i), q + 16)                 \
    INTO(sum, LANE(w2, i), q + 32)                 \
    INTO(sum, LANE(w3, i), q + 48)                 \
  }
#else
#define ADD(sum, i, c, r)                          \
  {                                                \
    __global const float* q = plane + LANE(at, i); \
    INTO(sum, LANE(w0, i), q)                      \
    INTO(sum, LANE(w1, i), q + 16)                 \
  }
#endif
// Named sums, not an array: compilers keep these in registers.
#define CLEAR(sum, i, c, r) VEC sum##_low = (VEC)(0.0f), sum##_high = (VEC)(0.0f);
#if VDVR_TAPS == 6
// What adding a run rounds off is summed beside the totals (Knuth's TwoSum: additions alone).
#define ZERO(sum, i, c, r)                                                                         \
  VEC sum##_low_total = (VEC)(0.0f), sum##_high_total = (VEC)(0.0f), sum##_low_rest = (VEC)(0.0f), \
      sum##_high_rest = (VEC)(0.0f);
#define ADD_RUN(total, rest, sum)                    \
  {                                                  \
    const VEC all = total + sum, part = all - total; \
    rest += (total - (all - part)) + (sum - part);   \
    total = all;                                     \
  }
#if VDVR_VECTORS == 2
#define TOTAL(sum, i, c, r)                           \
  ADD_RUN(sum##_low_total, sum##_low_rest, sum##_low) \
  ADD_RUN(sum##_high_total, sum##_high_rest, sum##_high)
#else
#define TOTAL(sum, i, c, r) ADD_RUN(sum##_low_total, sum##_low_rest, sum##_low)
#endif
#define CORRECT(sum, i, c, r)        \
  sum##_low_total += sum##_low_rest; \
  sum##_high_total += sum##_high_rest;
#else
#define ZERO(sum, i, c, r) VEC sum##_low_total = (VEC)(0.0f), sum##_high_total = (VEC)(0.0f);
#define TOTAL(sum, i, c, r)     \
  sum##_low_total += sum##_low; \
  sum##_high_total += sum##_high;
#endif
#define AGAIN(sum, i, c, r) sum##_low = sum##_high = (VEC)(0.0f);
#define PUT(sum, i, c, r)                                                               \
  if (x + c < nx && y + r < ny) {                                                       \
    STORE(sum##_low_total, target + (size_t)(r * nx + c) * out_stride);                 \
    if (VDVR_VECTORS == 2 && above > 0)                                                 \
      STORE(sum##_high_total, target + (size_t)(r * nx + c) * out_stride + VDVR_LANES); \
  }

__kernel void back_project(__global float* out, __global const float* filtered, __global const float4* steps,
                           __global const int2* rows, VdvrColumnBlocks shape) {
  // Copies, which no store can be taken to change.
  const int views = shape.views, columns = shape.columns, z_padded = shape.z_padded,
            out_stride = shape.out_stride, nx = shape.nx, ny = shape.ny;
  const int z = (int)get_global_id(0) * (VDVR_LANES * VDVR_VECTORS);
  const int x = (int)get_global_id(1) * TILE_X;
  const int tile_rows = (ny + TILE_Y - 1) / TILE_Y, row = (int)get_global_id(2);
  const int block = row / tile_rows, y = (row - block * tile_rows) * TILE_Y;
  if (z >= z_padded || x >= nx || block >= shape.blocks) return;

  // Columns outside every wanted interval are left as they are.
  const int2 wanted = rows[(size_t)block * ny + y];
  if (x > wanted.y || x + TILE_X - 1 < wanted.x) return;

  // Halves, which are exact, from the block's middle.
  const TILE tile_x = ((float)x - 0.5f * (float)(nx - 1)) + OFFSET_X,
             tile_y = ((float)y - 0.5f * (float)(ny - 1)) + OFFSET_Y;
  FOR_TILE(ZERO)
  __global const float* plane =
      filtered + (size_t)(shape.first_chunk + z / 16) * views * columns * 16 + z % 16;
  // From one vector of z to the next, in the same chunk or the next one; beyond the last the same one again.
  const int next = z + VDVR_LANES;
  const size_t above = next >= z_padded ? 0
                       : next % 16 != 0 ? VDVR_LANES
                                        : (size_t)views * columns * 16 - z % 16;
  __global const float4* view = steps + (size_t)block * views;
  FOR_TILE(CLEAR)
  for (int k = 0; k < views; ++k, plane += columns * 16) {
    const float4 step = view[k];
    const TILE s = fma((TILE)(step.x), tile_x, fma((TILE)(step.y), tile_y, (TILE)(step.z)));
    // Truncated, and one less where that is above: CPUs do it faster than floor.
    const ITILE cut = TO_ITILE(s), below = cut + IS_LESS(s, TO_TILE(cut));
    const TILE f = s - TO_TILE(below);
#if VDVR_TAPS != 6
    const TILE g = 1.0f - f;
#endif
#if VDVR_TAPS == 6
    const TILE m = f - 0.5f, square = m * m;
    const TILE even_a = VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_EVEN_A),
               odd_a = m * VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_ODD_A),
               even_b = VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_EVEN_B),
               odd_b = m * VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_ODD_B),
               even_c = VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_EVEN_C),
               odd_c = m * VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_ODD_C);
    const TILE w0 = even_a + odd_a, w1 = even_b + odd_b, w2 = even_c + odd_c, w3 = even_c - odd_c,
               w4 = even_b - odd_b, w5 = even_a - odd_a;
    const ITILE at = (clamp((int)step.w + below, (ITILE)2, (ITILE)(columns - 4)) - 2) * 16;
#elif VDVR_TAPS == 4
    // Lagrange weights on the nodes -1, 0, 1, 2.
    const TILE h = 2.0f - f, e = 1.0f + f, outer = f * g * (-1.0f / 6.0f), inner = e * h * 0.5f;
    const TILE w0 = outer * h, w1 = inner * g, w2 = inner * f, w3 = outer * e;
    const ITILE at = (clamp((int)step.w + below, (ITILE)1, (ITILE)(columns - 3)) - 1) * 16;
#else
    const TILE w0 = g, w1 = f;
    const ITILE at = clamp((int)step.w + below, (ITILE)0, (ITILE)(columns - 2)) * 16;
#endif
    FOR_TILE(ADD)
    // One loop, not one in another, which CPUs ran a fifth slower.
    if ((k + 1) % VDVR_RUN == 0) {
      FOR_TILE(TOTAL)
      FOR_TILE(AGAIN)
    }
  }
  FOR_TILE(TOTAL)
#if VDVR_TAPS == 6
  FOR_TILE(CORRECT)
#endif
  __global float* target = out + (((size_t)block * ny + y) * nx + x) * out_stride + shape.out_row + z;
  FOR_TILE(PUT)
}
