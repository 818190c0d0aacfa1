// How `verify` back-projects nodes of cone beam, apart from everything that build uses: lambda^-2 q(u, v) by
// eight points of Lagrange both ways (docs/error-bounds.md, "What verify does", "Cone beam").
// Layouts: float table[view][column][row]; View numbers[tile][block][view]; int2 tiles[tile] = first node x,
// y; float nodes[y][x][all_heights]. What reads like kept/cone_nodes.cl is written a second time: a fault in
// a shared line would be in what is certified and in what it is held to. Called by
// host/verify/witness/cone_nodes.cpp.
#include "device/lanes.h"
#include "shared/verify_cone.h"
#include "shared/verify_nodes.h"

// About the middle of a block, as host/verify/witness/cone_nodes.cpp fills it. xyz of a float4: by how
// much the numerator, or lambda, changes from node to node; w: what it is in the middle. A place counts from
// the column and the row in `whole`, so chosen that it is positive in all of the block.
typedef struct {
  float4 u, v, lambda;
  int4 whole;
} View;

// The eight weights on the nodes -3 .. 4: one factor of each of seven rotations of the nodes.
static inline ALWAYS_INLINE float8 lagrange(float f) {
  const float8 a = (f - (float8)(-2, -1, 0, 1, 2, 3, 4, -3)) * (f - (float8)(-1, 0, 1, 2, 3, 4, -3, -2)),
               b = (f - (float8)(0, 1, 2, 3, 4, -3, -2, -1)) * (f - (float8)(1, 2, 3, 4, -3, -2, -1, 0)),
               c = (f - (float8)(2, 3, 4, -3, -2, -1, 0, 1)) * (f - (float8)(3, 4, -3, -2, -1, 0, 1, 2)),
               d = (f - (float8)(4, -3, -2, -1, 0, 1, 2, 3)) * (float8)(-1.0f / 5040, 1.0f / 720, -1.0f / 240,
                                                                        1.0f / 144, -1.0f / 144, 1.0f / 240,
                                                                        -1.0f / 720, 1.0f / 5040);
  return (a * b) * (c * d);
}

static inline ALWAYS_INLINE float sum_of(float8 v) {
  const float4 four = v.lo + v.hi;
  const float2 two = four.lo + four.hi;
  return two.x + two.y;
}

#define COLUMN(j) vload8(0, from + (size_t)(j)*rows)
#define ADD(n, at_u, weight, at_v, part_v)                                             \
  {                                                                                    \
    __global const float* from =                                                       \
        plane + (size_t)clamp(at_u, 0, last_column) * rows + clamp(at_v, 0, last_row); \
    float8 across = (float8)(weight.s1) * COLUMN(1);                                   \
    across = fma((float8)(weight.s0), COLUMN(0), across);                              \
    across = fma((float8)(weight.s2), COLUMN(2), across);                              \
    across = fma((float8)(weight.s3), COLUMN(3), across);                              \
    across = fma((float8)(weight.s4), COLUMN(4), across);                              \
    across = fma((float8)(weight.s5), COLUMN(5), across);                              \
    across = fma((float8)(weight.s6), COLUMN(6), across);                              \
    across = fma((float8)(weight.s7), COLUMN(7), across);                              \
    sum##n = fma(lagrange(part_v), across, sum##n);                                    \
  }

#if VDVR_LANES > 8
#error "each height has eight sums: eight lanes at most"
#endif
#define CLEAR(n) float8 sum##n = (float8)(0.0f);
#if VDVR_UPRIGHT
#define PART(n) ADD(n, column, weight, LANE(row, n), LANE(part_v, n))
#else
#define PART(n)                                                                              \
  {                                                                                          \
    const float8 weight = (LANE(inverse, n) * LANE(inverse, n)) * lagrange(LANE(part_u, n)); \
    ADD(n, LANE(column, n), weight, LANE(row, n), LANE(part_v, n))                           \
  }
#endif
#define PUT(n) to[n] = accumulate ? to[n] + sum_of(sum##n) : sum_of(sum##n);

// Adds the table's views at VDVR_LANES heights of eight nodes along x. VDVR_UPRIGHT: u and lambda do not
// change along z in any view.
__kernel void verify_cone(__global float* nodes, __global const float* table, __global const View* numbers,
                          __global const int2* tiles, VdvrVerifyCone s) {
  const int height = (int)get_global_id(0) * VDVR_LANES, y = (int)get_global_id(1),
            tile = (int)get_global_id(2), block = height / VDVR_VERIFY_CONE_BLOCK;
  if (block >= s.blocks || y >= VDVR_VERIFY_TILE || tile >= s.tiles) return;
  // Copies, which no store can be taken to change.
  const int accumulate = s.accumulate, views = s.views, rows = s.rows, last_column = s.columns - 8,
            last_row = s.rows - 8;
  const size_t plane_size = (size_t)s.columns * (size_t)s.rows;
  const float dy = (float)y - 0.5f * (float)(VDVR_VERIFY_TILE - 1);
  const VEC dz =
      TO_VEC(height - block * VDVR_VERIFY_CONE_BLOCK + INDEX) - 0.5f * (float)(VDVR_VERIFY_CONE_BLOCK - 1);
  const int2 first = tiles[s.first_tile + tile];
  __global const View* own = numbers + ((size_t)tile * s.blocks + block) * views;
  for (int x = 0; x < VDVR_VERIFY_TILE; ++x) {
    const float dx = (float)x - 0.5f * (float)(VDVR_VERIFY_TILE - 1);
    __global const View* view = own;
    __global const float* plane = table;
    FOR_LANES(CLEAR)
    for (int k = 0; k < views; ++k, ++view, plane += plane_size) {
      const float4 u = view->u, v = view->v, lambda = view->lambda;
      const int4 whole = view->whole;
#if VDVR_UPRIGHT
      const float inverse = 1.0f / (fma(lambda.x, dx, lambda.y * dy) + lambda.w),
                  place_u = fma(fma(u.x, dx, u.y * dy), inverse, u.w);
      const int below_u = (int)place_u, column = whole.x + below_u - 3;
      const float8 weight = (inverse * inverse) * lagrange(place_u - (float)below_u);
#else
      const VEC inverse = 1.0f / fma((VEC)(lambda.z), dz, (VEC)(fma(lambda.x, dx, lambda.y * dy) + lambda.w)),
                place_u = fma(fma((VEC)(u.z), dz, (VEC)(fma(u.x, dx, u.y * dy))), inverse, (VEC)(u.w));
      const INT below_u = TO_INT(place_u), column = whole.x + below_u - 3;
      const VEC part_u = place_u - TO_VEC(below_u);
#endif
      const VEC place_v = fma(fma((VEC)(v.z), dz, (VEC)(fma(v.x, dx, v.y * dy))), (VEC)(inverse), (VEC)(v.w));
      // Places are positive: truncation is floor.
      const INT below_v = TO_INT(place_v), row = whole.y + below_v - 3;
      const VEC part_v = place_v - TO_VEC(below_v);
      FOR_LANES(PART)
    }
    __global float* to =
        nodes + ((size_t)(first.y + y) * s.nx + (size_t)(first.x + x)) * s.all_heights + height;
    FOR_LANES(PUT)
  }
}
