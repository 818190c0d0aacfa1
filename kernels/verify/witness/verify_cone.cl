// How `verify` back-projects nodes of cone beam, apart from everything that build uses: lambda^-2 q(u, v) by
// eight points of Lagrange both ways (docs/error-bounds.md, "What verify does", "Cone beam").
// Layouts: float table[view][column][row]; View numbers[tile][block][view]; float
// nodes[slot][y][x][all_heights]; int slots[tile]; uchar wanted[tile][block]; uchar4 ranges[tile] = first and
// last x, then y. What reads like kept/cone_nodes.cl is written a second time: a fault in a shared line would
// be in what is certified and in what it is held to. Called by host/verify/witness/cone_nodes.cpp.
#include "device/eight_points.h"
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

// 1 / lambda to a unit in the last place: what a quotient errs, some units, is squared by a step of Newton's.
#define RECIPROCAL(TYPE, NAME, lambda) \
  TYPE NAME = 1.0f / (lambda);         \
  NAME = fma(NAME, fma(-(lambda), NAME, (TYPE)(1.0f)), NAME);

#if VDVR_UPRIGHT
// What does not change along z: the weights of eight columns, over lambda^2, 1 / lambda, and the first
// column.
typedef struct {
  float8 weight;
  float inverse;
  int column;
} Across;

static inline ALWAYS_INLINE Across look_across(__global const View* view, float dx, float dy) {
  const float4 u = view->u, lambda = view->lambda;
  const float of = fma(lambda.x, dx, lambda.y * dy) + lambda.w;
  RECIPROCAL(float, inverse, of)
  const float place_u = fma(fma(u.x, dx, u.y * dy), inverse, u.w);
  const int below_u = (int)place_u;
  const float8 weight = (inverse * inverse) * lagrange(place_u - (float)below_u);
  const Across out = {weight, inverse, view->whole.x + below_u - 3};
  return out;
}
#endif

#if VDVR_STRIPS
#if VDVR_LANES != 8 || VDVR_VERIFY_CONE_BLOCK != 16 || !VDVR_UPRIGHT
#error "a strip serves two vectors of eight heights of upright views"
#endif

// A block of heights as a view sees it: rows of its eight columns, weighted and added up, and by height the
// first of its eight rows and the place between the middle two. The sums are those of ADD, to the bit.
typedef struct {
  float16 strip[VDVR_VERIFY_CONE_STRIP / 16];
  float part[VDVR_VERIFY_CONE_BLOCK];
  int row[VDVR_VERIFY_CONE_BLOCK];
} Seen;

#define STRIP(j) vload16(0, from + (size_t)(j)*rows)
static inline ALWAYS_INLINE void look_up(Seen* seen, __global const View* view, __global const float* plane,
                                         float dx, float dy, int rows, int last_column, int last_row) {
  const Across a = look_across(view, dx, dy);
  const float16 dz = convert_float16((int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)) -
                     0.5f * (float)(VDVR_VERIFY_CONE_BLOCK - 1);
  const float4 v = view->v;
  const float16 place =
      fma(fma((float16)(v.z), dz, (float16)(fma(v.x, dx, v.y * dy))), (float16)(a.inverse), (float16)(v.w));
  const int16 below = convert_int16(place),
              row = clamp(view->whole.y + below - 3, (int16)(0), (int16)(last_row));
  // Rows follow one another in z: rounding keeps order.
  const int low = min(row.s0, row.sf), span = max(row.s0, row.sf) - low + 8,
            chunks = min((span + 15) / 16, VDVR_VERIFY_CONE_STRIP / 16);
  vstore16(place - convert_float16(below), 0, seen->part);
  vstore16(min(row - low, (int16)(VDVR_VERIFY_CONE_STRIP - 8)), 0, seen->row);
  __global const float* from = plane + (size_t)clamp(a.column, 0, last_column) * rows + low;
  for (int c = 0; c < chunks; ++c, from += 16) {
    float16 across = (float16)(a.weight.s1) * STRIP(1);
    across = fma((float16)(a.weight.s0), STRIP(0), across);
    across = fma((float16)(a.weight.s2), STRIP(2), across);
    across = fma((float16)(a.weight.s3), STRIP(3), across);
    across = fma((float16)(a.weight.s4), STRIP(4), across);
    across = fma((float16)(a.weight.s5), STRIP(5), across);
    across = fma((float16)(a.weight.s6), STRIP(6), across);
    seen->strip[c] = fma((float16)(a.weight.s7), STRIP(7), across);
  }
}

#define FOR_PAIRS(DO) DO(0) DO(1) DO(2) DO(3)
#define TAKE(n) float16 sum##n = vload16(n, of);
#define ADD_ROWS(n)                                                                                   \
  {                                                                                                   \
    const float16 place = (float16)((float8)(part[2 * n]), (float8)(part[2 * n + 1])),                \
                  rows = (float16)(vload8(0, strip + row[2 * n]), vload8(0, strip + row[2 * n + 1])); \
    sum##n = fma(lagrange_of_two(place), rows, sum##n);                                               \
  }
#define KEEP(n) vstore16(sum##n, n, of);
// Adds some views at eight heights, from `first` of the block on, two of them in a vector.
static inline ALWAYS_INLINE void add_views(float* of, const Seen* seen, int views, int first) {
  FOR_PAIRS(TAKE)
  for (int i = 0; i < views; ++i) {
    const float *strip = (const float*)seen[i].strip, *part = seen[i].part + first;
    const int* row = seen[i].row + first;
    FOR_PAIRS(ADD_ROWS)
  }
  FOR_PAIRS(KEEP)
}

// Adds the table's views at a block of heights of eight nodes along x.
__kernel void verify_cone(__global float* nodes, __global const float* table, __global const View* numbers,
                          __global const int* slots, __global const uchar* wanted,
                          __global const uchar4* ranges, VdvrVerifyCone s) {
  const int block = (int)get_global_id(0), y = (int)get_global_id(1), tile = (int)get_global_id(2);
  if (block >= s.blocks || y >= VDVR_VERIFY_TILE || tile >= s.tiles) return;
  if (wanted[(size_t)(s.first_tile + tile) * s.blocks + block] == 0) return;
  const uchar4 range = ranges[s.first_tile + tile];
  if (y < range.z || y > range.w) return;
  const int last_column = s.columns - 8, last_row = s.rows - 8;
  const size_t plane_size = (size_t)s.columns * (size_t)s.rows;
  const float dy = (float)y - 0.5f * (float)(VDVR_VERIFY_TILE - 1);
  const int slot = slots[s.first_tile + tile], more = block * VDVR_VERIFY_CONE_BLOCK + 8 < s.used;
  __global const View* own = numbers + ((size_t)tile * s.blocks + block) * s.views;
  float8 sums[VDVR_VERIFY_TILE * VDVR_VERIFY_CONE_BLOCK];
  for (int i = 0; i < VDVR_VERIFY_TILE * VDVR_VERIFY_CONE_BLOCK; ++i) sums[i] = (float8)(0.0f);
  Seen seen[VDVR_VERIFY_CONE_VIEWS];
  // Some views go through all eight nodes, whose columns overlap, before the next ones.
  for (int k = 0; k < s.views; k += VDVR_VERIFY_CONE_VIEWS) {
    const int together = min(VDVR_VERIFY_CONE_VIEWS, s.views - k);
    for (int x = range.x; x <= range.y; ++x) {
      const float dx = (float)x - 0.5f * (float)(VDVR_VERIFY_TILE - 1);
      for (int i = 0; i < together; ++i)
        look_up(seen + i, own + k + i, table + (size_t)(k + i) * plane_size, dx, dy, s.rows, last_column,
                last_row);
      float* of = (float*)(sums + x * VDVR_VERIFY_CONE_BLOCK);
      add_views(of, seen, together, 0);
      if (more) add_views(of + 64, seen, together, 8);
    }
  }
  for (int x = range.x; x <= range.y; ++x) {
    __global float* to = nodes +
                         (size_t)((slot * VDVR_VERIFY_TILE + y) * VDVR_VERIFY_TILE + x) * s.all_heights +
                         block * VDVR_VERIFY_CONE_BLOCK;
    for (int i = 0; i < VDVR_VERIFY_CONE_BLOCK; ++i) {
      const float sum = sum_of(sums[x * VDVR_VERIFY_CONE_BLOCK + i]);
      to[i] = s.accumulate ? to[i] + sum : sum;
    }
  }
}

#else
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
                          __global const int* slots, __global const uchar* wanted,
                          __global const uchar4* ranges, VdvrVerifyCone s) {
  const int height = (int)get_global_id(0) * VDVR_LANES, y = (int)get_global_id(1),
            tile = (int)get_global_id(2), block = height / VDVR_VERIFY_CONE_BLOCK;
  if (block >= s.blocks || y >= VDVR_VERIFY_TILE || tile >= s.tiles) return;
  if (wanted[(size_t)(s.first_tile + tile) * s.blocks + block] == 0) return;
  const uchar4 range = ranges[s.first_tile + tile];
  if (y < range.z || y > range.w) return;
  // Copies, which no store can be taken to change.
  const int accumulate = s.accumulate, views = s.views, rows = s.rows, last_column = s.columns - 8,
            last_row = s.rows - 8;
  const size_t plane_size = (size_t)s.columns * (size_t)s.rows;
  const float dy = (float)y - 0.5f * (float)(VDVR_VERIFY_TILE - 1);
  const VEC dz =
      TO_VEC(height - block * VDVR_VERIFY_CONE_BLOCK + INDEX) - 0.5f * (float)(VDVR_VERIFY_CONE_BLOCK - 1);
  const int slot = slots[s.first_tile + tile];
  __global const View* own = numbers + ((size_t)tile * s.blocks + block) * views;
  for (int x = range.x; x <= range.y; ++x) {
    const float dx = (float)x - 0.5f * (float)(VDVR_VERIFY_TILE - 1);
    __global const View* view = own;
    __global const float* plane = table;
    FOR_LANES(CLEAR)
    for (int k = 0; k < views; ++k, ++view, plane += plane_size) {
      const float4 v = view->v;
      const int4 whole = view->whole;
#if VDVR_UPRIGHT
      const Across a = look_across(view, dx, dy);
      const float inverse = a.inverse;
      const int column = a.column;
      const float8 weight = a.weight;
#else
      const float4 u = view->u, lambda = view->lambda;
      const VEC of = fma((VEC)(lambda.z), dz, (VEC)(fma(lambda.x, dx, lambda.y * dy) + lambda.w));
      RECIPROCAL(VEC, inverse, of)
      const VEC place_u = fma(fma((VEC)(u.z), dz, (VEC)(fma(u.x, dx, u.y * dy))), inverse, (VEC)(u.w));
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
        nodes + (size_t)((slot * VDVR_VERIFY_TILE + y) * VDVR_VERIFY_TILE + x) * s.all_heights + height;
    FOR_LANES(PUT)
  }
}
#endif
