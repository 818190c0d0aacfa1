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
#if VDVR_LANES != 8 || VDVR_VERIFY_CONE_BLOCK != 16
#error "a strip serves two vectors of eight heights"
#endif

// A block of heights as a view sees it: rows of its eight columns, weighted and added up, and by height the
// first of its eight rows and the place between the middle two. Of upright views the sums are those of ADD,
// to the bit. Where views lean, heights lie on a straight line that crosses columns: each row has the weights
// of its place on that line, and what eight rows are interpolated from is q along it.
typedef struct {
  float16 strip[VDVR_VERIFY_CONE_STRIP / 16];
  float part[VDVR_VERIFY_CONE_BLOCK];
#if !VDVR_UPRIGHT
  float weight[VDVR_VERIFY_CONE_BLOCK];  // lambda^-2
#endif
  int row[VDVR_VERIFY_CONE_BLOCK];
} Seen;

#define SIXTEEN convert_float16((int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#if VDVR_UPRIGHT
#define STRIP(j) vload16(0, from + (size_t)(j)*rows)
#else
#define STRIP(j) vload8(0, from + (size_t)(j)*rows)
#endif
// The strip's first row, and how many it has. Of upright views rows follow one another in z, and rounding
// keeps their order; lambda's may change it.
static inline ALWAYS_INLINE int2 take_places(Seen* seen, float16 place, int whole, int last_row) {
  const int16 below = convert_int16(place), row = clamp(whole + below - 3, (int16)(0), (int16)(last_row));
#if VDVR_UPRIGHT
  const int low = min(row.s0, row.sf), high = max(row.s0, row.sf);
#else
  const int8 low8 = min(row.lo, row.hi), high8 = max(row.lo, row.hi);
  const int4 low4 = min(low8.lo, low8.hi), high4 = max(high8.lo, high8.hi);
  const int2 low2 = min(low4.lo, low4.hi), high2 = max(high4.lo, high4.hi);
  const int low = min(low2.s0, low2.s1), high = max(high2.s0, high2.s1);
#endif
  vstore16(place - convert_float16(below), 0, seen->part);
  vstore16(min(row - low, (int16)(VDVR_VERIFY_CONE_STRIP - 8)), 0, seen->row);
  return (int2)(low, min(high - low + 8, VDVR_VERIFY_CONE_STRIP));
}

static inline ALWAYS_INLINE void look_up(Seen* seen, __global const View* view, __global const float* plane,
                                         float dx, float dy, int rows, int last_column, int last_row) {
  const float4 v = view->v;
  const float16 dz = SIXTEEN - 0.5f * (float)(VDVR_VERIFY_CONE_BLOCK - 1);
#if VDVR_UPRIGHT
  const Across a = look_across(view, dx, dy);
  const float16 place =
      fma(fma((float16)(v.z), dz, (float16)(fma(v.x, dx, v.y * dy))), (float16)(a.inverse), (float16)(v.w));
  const int2 strip = take_places(seen, place, view->whole.y, last_row);
  __global const float* from = plane + (size_t)clamp(a.column, 0, last_column) * rows + strip.s0;
  for (int c = 0; c < (strip.s1 + 15) / 16; ++c, from += 16) {
    float16 across = (float16)(a.weight.s1) * STRIP(1);
    across = fma((float16)(a.weight.s0), STRIP(0), across);
    across = fma((float16)(a.weight.s2), STRIP(2), across);
    across = fma((float16)(a.weight.s3), STRIP(3), across);
    across = fma((float16)(a.weight.s4), STRIP(4), across);
    across = fma((float16)(a.weight.s5), STRIP(5), across);
    across = fma((float16)(a.weight.s6), STRIP(6), across);
    seen->strip[c] = fma((float16)(a.weight.s7), STRIP(7), across);
  }
#else
  const float4 u = view->u, lambda = view->lambda;
  const float of = fma(lambda.x, dx, lambda.y * dy) + lambda.w, of_v = fma(v.x, dx, v.y * dy);
  RECIPROCAL(float, inverse, of)
  const float from_u = fma(u.x, dx, u.y * dy) * inverse, from_v = of_v * inverse,
              rows_up = fma(-lambda.z, from_v, v.z);
  RECIPROCAL(float, height_a_row, rows_up)
  const float columns_a_row = fma(-lambda.z, from_u, u.z) * height_a_row;
  const float16 of_height = fma((float16)(lambda.z), dz, (float16)(of));
  RECIPROCAL(float16, inverses, of_height)
  const float16 place = fma(fma((float16)(v.z), dz, (float16)(of_v)), inverses, (float16)(v.w));
  const int2 strip = take_places(seen, place, view->whole.y, last_row);
  vstore16(inverses * inverses, 0, seen->weight);
  const float middle_u = from_u + u.w, middle_v = from_v + v.w;
  float8* across = (float8*)seen->strip;
  for (int c = 0; c < (strip.s1 + 7) / 8; ++c) {
    // Where the line crosses the middle of eight rows, and from there the place of each. It is positive: rows
    // that count lie so near to a height that it moves by less than a place.
    const int first = strip.s0 + 8 * c;
    const float at_u = fma(columns_a_row, (float)(first - view->whole.y) + 3.5f - middle_v, middle_u);
    const int below = (int)at_u;
    const float8 g = fma((float8)(columns_a_row), SIXTEEN.lo - 3.5f, (float8)(at_u - (float)below - 0.5f));
    __global const float* from =
        plane + (size_t)clamp(view->whole.x + below - 3, 0, last_column) * rows + first;
    float8 sum = (float8)(0.0f);
    ADD_POINTS(sum, g, STRIP)
    across[c] = sum;
  }
#endif
}

// Sums of eight heights: of four at a time those of the four points below, then those of the points above
// from the outside in, which have the same polynomials. Heights 0, 4, 1 and 5 come first, then 2, 6, 3 and 7:
// processors spread places within halves of a vector.
typedef struct {
  float16 below[2], above[2];
} Sums;

typedef float8 __attribute__((aligned(4))) LooseEight;
typedef float4 __attribute__((aligned(4))) LooseFour;
#define ROWS_BELOW(i) *(const LooseFour*)(strip + row[i])
#define ROWS_ABOVE(i) (*(const LooseFour*)(strip + row[i] + 4)).wzyx
#define ROWS_OF(ROWS, i, j) (float16)(ROWS(i), ROWS(i + 4), ROWS(j), ROWS(j + 4))
#if VDVR_UPRIGHT
#define WEIGH(weights, EACH) weights
#else
#define WEIGH(weights, EACH) ((*(const LooseEight*)(seen[v].weight + first)).EACH * weights)
#endif
#define ADD_FOUR(n, i, j, EACH)                                         \
  {                                                                     \
    float16 below = of->below[n], above = of->above[n];                 \
    for (int v = 0; v < views; ++v) {                                   \
      const float* strip = (const float*)seen[v].strip;                 \
      const int* row = seen[v].row + first;                             \
      const float8 part = *(const LooseEight*)(seen[v].part + first);   \
      float16 low, high;                                                \
      lagrange_of_four(part.EACH, &low, &high);                         \
      below = fma(WEIGH(low, EACH), ROWS_OF(ROWS_BELOW, i, j), below);  \
      above = fma(WEIGH(high, EACH), ROWS_OF(ROWS_ABOVE, i, j), above); \
    }                                                                   \
    of->below[n] = below;                                               \
    of->above[n] = above;                                               \
  }
// Adds some views at eight heights, from `first` of the block on.
static inline ALWAYS_INLINE void add_views(Sums* of, const Seen* seen, int views, int first) {
  ADD_FOUR(0, 0, 1, s0000444411115555)
  ADD_FOUR(1, 2, 3, s2222666633337777)
}

// What a height's eight sums add up to.
#define TOTAL(n, part) sum_of((float8)(s->below[n].s##part, s->above[n].s##part))
static inline ALWAYS_INLINE float8 totals_of(const Sums* s) {
  return (float8)(TOTAL(0, 0123), TOTAL(0, 89ab), TOTAL(1, 0123), TOTAL(1, 89ab), TOTAL(0, 4567),
                  TOTAL(0, cdef), TOTAL(1, 4567), TOTAL(1, cdef));
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
  Sums sums[VDVR_VERIFY_TILE][VDVR_VERIFY_CONE_BLOCK / 8];
  for (int i = 0; i < VDVR_VERIFY_TILE * VDVR_VERIFY_CONE_BLOCK / 8; ++i)
    for (int n = 0; n < 2; ++n) sums[i / 2][i % 2].below[n] = sums[i / 2][i % 2].above[n] = (float16)(0.0f);
  Seen seen[VDVR_VERIFY_CONE_VIEWS];
  // Some views go through all eight nodes, whose columns overlap, before the next ones.
  for (int k = 0; k < s.views; k += VDVR_VERIFY_CONE_VIEWS) {
    const int together = min(VDVR_VERIFY_CONE_VIEWS, s.views - k);
    for (int x = range.x; x <= range.y; ++x) {
      const float dx = (float)x - 0.5f * (float)(VDVR_VERIFY_TILE - 1);
      for (int i = 0; i < together; ++i)
        look_up(seen + i, own + k + i, table + (size_t)(k + i) * plane_size, dx, dy, s.rows, last_column,
                last_row);
      add_views(&sums[x][0], seen, together, 0);
      if (more) add_views(&sums[x][1], seen, together, 8);
    }
  }
  for (int x = range.x; x <= range.y; ++x) {
    __global float* to = nodes +
                         (size_t)((slot * VDVR_VERIFY_TILE + y) * VDVR_VERIFY_TILE + x) * s.all_heights +
                         block * VDVR_VERIFY_CONE_BLOCK;
    for (int i = 0; i < VDVR_VERIFY_CONE_BLOCK / 8; ++i) {
      const float8 totals = totals_of(&sums[x][i]);
      vstore8(s.accumulate ? vload8(i, to) + totals : totals, i, to);
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
