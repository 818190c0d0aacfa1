// Back-projection onto columns of z samples: out[block][y][x][z] = sum_k q_k(t_k(x, y), z), the paper's Eq. 2
// with the view weights folded into q. Layouts: float filtered[z / 16][view][column n][16], so that
// neighbouring columns are neighbouring cache lines and no power-of-two stride maps them onto one cache set;
// float out[block][y][x][out_stride]; per block and view a float4 {step of s along x, along y, s in the
// block's middle less the nearest integer, that integer}. One work-item carries VDVR_LANES samples of z for
// tiles of neighbours in x and y: position, index and weights are shared by the whole column, and the loads
// are contiguous. It takes a run of VDVR_RUN views through all its tiles before the next run, so that caches
// hold what neighbouring tiles read. Positions are relative to the block's middle, so fp32 holds them; a
// run's sums are added to those of others (docs/error-bounds.md, section 7). rows int2[block][y]: the first
// and last column of that row (and of the tile's rows above it) that anyone wants. Called by
// host/field/fbp/back_project.cpp.
#include "device/lanes.h"
#include "shared/back_project.h"
#include "shared/column_taps.h"

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
// Tiles of a work-item along x and along y, whose sums lie in private memory where they are many.
#ifndef VDVR_TILES_X
#define VDVR_TILES_X 1
#endif
#ifndef VDVR_TILES_Y
#define VDVR_TILES_Y 1
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
#define OF_TILE(v, i) v.i
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
#define OF_TILE(v, i) v
#define IS_LESS(a, b) (-((a) < (b)))
#else
#error "VDVR_TILE is 1 or 8"
#endif

// Named sums, not an array: compilers keep these in registers.
#define CLEAR(sum, i, c, r) VEC sum##_low = (VEC)(0.0f), sum##_high = (VEC)(0.0f);
#define TAP(w, q, low, high)         \
  low = fma((VEC)(w), LOAD(q), low); \
  if (VDVR_VECTORS == 2) high = fma((VEC)(w), LOAD((q) + above), high);
#if VDVR_TAPS == 6
// A view's six products apart: a term meets five additions there, and then one for each view of the run.
#define ADD(sum, i, c, r)                                                  \
  {                                                                        \
    __global const float* q = plane + OF_TILE(at, i);                      \
    VEC low = (VEC)(OF_TILE(w0, i)) * LOAD(q), high = low;                 \
    if (VDVR_VECTORS == 2) high = (VEC)(OF_TILE(w0, i)) * LOAD(q + above); \
    TAP(OF_TILE(w1, i), q + 16, low, high)                                 \
    TAP(OF_TILE(w2, i), q + 32, low, high)                                 \
    TAP(OF_TILE(w3, i), q + 48, low, high)                                 \
    TAP(OF_TILE(w4, i), q + 64, low, high)                                 \
    TAP(OF_TILE(w5, i), q + 80, low, high)                                 \
    sum##_low += low;                                                      \
    if (VDVR_VECTORS == 2) sum##_high += high;                             \
  }
#elif VDVR_TAPS == 4
#define ADD(sum, i, c, r)                              \
  {                                                    \
    __global const float* q = plane + OF_TILE(at, i);  \
    TAP(OF_TILE(w0, i), q, sum##_low, sum##_high)      \
    TAP(OF_TILE(w1, i), q + 16, sum##_low, sum##_high) \
    TAP(OF_TILE(w2, i), q + 32, sum##_low, sum##_high) \
    TAP(OF_TILE(w3, i), q + 48, sum##_low, sum##_high) \
  }
#else
#define ADD(sum, i, c, r)                              \
  {                                                    \
    __global const float* q = plane + OF_TILE(at, i);  \
    TAP(OF_TILE(w0, i), q, sum##_low, sum##_high)      \
    TAP(OF_TILE(w1, i), q + 16, sum##_low, sum##_high) \
  }
#endif
// Where a tile keeps the sums of its runs: [column][vector].
#define TILE_PLACES (TILE_X * TILE_Y * VDVR_VECTORS)
#define PLACE(c, r, vector) (tile + ((r)*TILE_X + (c)) * VDVR_VECTORS + (vector))
#if VDVR_TAPS == 6
// What adding a run rounds off is summed beside the totals (Knuth's TwoSum: additions alone).
#define ADD_RUN(place, sum)                                                 \
  {                                                                         \
    const VEC total = totals[place], all = total + sum, part = all - total; \
    rests[place] += (total - (all - part)) + (sum - part);                  \
    totals[place] = all;                                                    \
  }
#define CORRECTED(place) (totals[place] + rests[place])
#else
#define ADD_RUN(place, sum) totals[place] += sum;
#define CORRECTED(place) totals[place]
#endif
#define JOIN(sum, i, c, r)           \
  ADD_RUN(PLACE(c, r, 0), sum##_low) \
  if (VDVR_VECTORS == 2) ADD_RUN(PLACE(c, r, VDVR_VECTORS - 1), sum##_high)
#define PUT(sum, i, c, r)                                                                                 \
  if (x + c < nx && y + r < ny) {                                                                         \
    __global float* to = target + (size_t)(r * nx + c) * out_stride;                                      \
    STORE(CORRECTED(PLACE(c, r, 0)), to);                                                                 \
    if (VDVR_VECTORS == 2 && above > 0) STORE(CORRECTED(PLACE(c, r, VDVR_VECTORS - 1)), to + VDVR_LANES); \
  }

__kernel void back_project(__global float* out, __global const float* filtered, __global const float4* steps,
                           __global const int2* rows, VdvrColumnBlocks shape) {
  // Copies, which no store can be taken to change.
  const int views = shape.views, columns = shape.columns, z_padded = shape.z_padded,
            out_stride = shape.out_stride, nx = shape.nx, ny = shape.ny;
  const int z = (int)get_global_id(0) * (VDVR_LANES * VDVR_VECTORS);
  const int first_x = (int)get_global_id(1) * (TILE_X * VDVR_TILES_X);
  const int high = TILE_Y * VDVR_TILES_Y, bands = (ny + high - 1) / high, band = (int)get_global_id(2);
  const int block = band / bands, first_y = (band - block * bands) * high;
  if (z >= z_padded || first_x >= nx || block >= shape.blocks) return;

  __global const float* chunk =
      filtered + (size_t)(shape.first_chunk + z / 16) * views * columns * 16 + z % 16;
  // From one vector of z to the next, in the same chunk or the next one; beyond the last the same one again.
  const int next = z + VDVR_LANES;
  const size_t above = next >= z_padded ? 0
                       : next % 16 != 0 ? VDVR_LANES
                                        : (size_t)views * columns * 16 - z % 16;
  VEC totals[VDVR_TILES_X * VDVR_TILES_Y * TILE_PLACES];
#if VDVR_TAPS == 6
  VEC rests[VDVR_TILES_X * VDVR_TILES_Y * TILE_PLACES];
#endif
  for (int i = 0; i < VDVR_TILES_X * VDVR_TILES_Y * TILE_PLACES; ++i) {
    totals[i] = (VEC)(0.0f);
#if VDVR_TAPS == 6
    rests[i] = (VEC)(0.0f);
#endif
  }
  for (int run = 0; run < views; run += VDVR_RUN)
    for (int ty = 0; ty < VDVR_TILES_Y; ++ty) {
      const int y = first_y + ty * TILE_Y;
      if (y >= ny) break;
      // Columns outside every wanted interval are left as they are.
      const int2 wanted = rows[(size_t)block * ny + y];
      for (int tx = 0; tx < VDVR_TILES_X; ++tx) {
        const int x = first_x + tx * TILE_X;
        if (x >= nx || x > wanted.y || x + TILE_X - 1 < wanted.x) continue;
        const int tile = (ty * VDVR_TILES_X + tx) * TILE_PLACES, end = min(run + VDVR_RUN, views);
        // Halves, which are exact, from the block's middle.
        const TILE tile_x = ((float)x - 0.5f * (float)(nx - 1)) + OFFSET_X,
                   tile_y = ((float)y - 0.5f * (float)(ny - 1)) + OFFSET_Y;
        __global const float4* view = steps + (size_t)block * views;
        __global const float* plane = chunk + (size_t)run * columns * 16;
        FOR_TILE(CLEAR)
        for (int k = run; k < end; ++k, plane += columns * 16) {
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
          const TILE even_a = VDVR_TAPS_FUSED(TILE, square, VDVR_SIX_EVEN_A),
                     odd_a = m * VDVR_TAPS_FUSED(TILE, square, VDVR_SIX_ODD_A),
                     even_b = VDVR_TAPS_FUSED(TILE, square, VDVR_SIX_EVEN_B),
                     odd_b = m * VDVR_TAPS_FUSED(TILE, square, VDVR_SIX_ODD_B),
                     even_c = VDVR_TAPS_FUSED(TILE, square, VDVR_SIX_EVEN_C),
                     odd_c = m * VDVR_TAPS_FUSED(TILE, square, VDVR_SIX_ODD_C);
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
        }
        FOR_TILE(JOIN)
        if (end < views) continue;
        __global float* target = out + (((size_t)block * ny + y) * nx + x) * out_stride + shape.out_row + z;
        FOR_TILE(PUT)
      }
    }
}
