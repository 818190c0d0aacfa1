// Kept nodes of cone beam where all detectors stand upright: u, lambda and the weights of eight columns
// belong to a whole column of nodes. They are applied once to the rows that a run of heights reads, which
// gives a strip, and each height takes eight rows of it (docs/error-bounds.md, section 16). Layouts and what
// is added are those of cone_nodes.cl, to the bit. A work-item does a run of heights of some rows of a tile,
// some views at a time: what they read stays in caches. In double precision only. Called by
// host/certify/kept/cone_tiles.cpp.
#define VDVR_LANES 8
#define VDVR_DOUBLE 1
#include "device/cone_taps.h"
#include "device/lanes.h"
#include "shared/cone_nodes.h"

#define RUN VDVR_CONE_RUN
#define GROUPS (RUN / VDVR_LANES)
#if GROUPS != 8
#error "the middles of a run's groups of heights are a vector of eight"
#endif
// Views whose strips are made together, and vectors of a strip.
#define TOGETHER VDVR_CONE_VIEWS
#define CHUNKS (VDVR_CONE_STRIP / 16)

// What a column of nodes reads of a view: strip, and by height the first of eight rows, and the place g
// between the two in the middle. Arrays on purpose: what is taken from them by the element would
// cost more from registers.
typedef struct {
  float16 strip[CHUNKS];
  float g[RUN] __attribute__((aligned(64)));
  int row[RUN];
} Seen;

static ALWAYS_INLINE int floor_of(double v) {
  const int cut = (int)v;
  return cut - ((double)cut > v);
}

#define COLUMN(j) (*(__global const float16*)(from + (size_t)(j)*stride))
static ALWAYS_INLINE void make_strip(float16* to, __global const float* from, int stride, int chunks,
                                     float8 weight) {
  for (int c = 0; c < chunks; ++c, from += 16) {
    WEIGH_COLUMNS(float16, weight, COLUMN)
    to[c] = left + right;
  }
}

// Heights follow one another `slope` rows apart, the lowest half a row above `lowest` beyond row `whole` of
// the strip: the row below a place is the nearest to what is half a row less. In floats about the middle of
// eight.
static ALWAYS_INLINE void place_heights(Seen* seen, double lowest, double slope, int whole, int last) {
  const double8 middle = fma(
      (double8)(slope), (double8)(3.5f, 11.5f, 19.5f, 27.5f, 35.5f, 43.5f, 51.5f, 59.5f), (double8)(lowest));
  const int8 cuts = convert_int8(middle);
  const float8 parts = convert_float8(middle - convert_double8(cuts));
  int cut[GROUPS];
  float part[GROUPS];
  vstore8(cuts + whole, 0, cut);
  vstore8(parts, 0, part);
  const float16 from_middle = (float16)(TO_VEC(INDEX), TO_VEC(INDEX)) - 3.5f;
  for (int j = 0; j < GROUPS / 2; ++j) {
    const float16 at = fma((float16)((float)slope), from_middle,
                           (float16)((float8)(part[2 * j]), (float8)(part[2 * j + 1]))),
                  nearest = at + TO_WHOLE, whole_rows = nearest - TO_WHOLE;
    const int16 row =
        as_int16(nearest) - as_int(TO_WHOLE) + (int16)((int8)(cut[2 * j]), (int8)(cut[2 * j + 1]));
    vstore16(at - whole_rows, j, seen->g);
    vstore16(clamp(row, (int16)(0), (int16)(last)), j, seen->row);
  }
}

// Where a column of nodes lies in a view: the lowest of its heights and the slope of these, in rows beyond
// row `whole`, and from which rows and columns its strip is made.
typedef struct {
  double lowest, slope;
  float8 weight;
  size_t first;
  int whole, chunks, last;
} Place;

// dx, dy, dz: nodes from the tile's middle to the lowest of so many heights.
static ALWAYS_INLINE Place place_in(__global const ConeView* v, double dx, double dy, double dz, int heights,
                                    VdvrConeNodes s) {
  const double inverse = 1.0f / (fma(v->step_lambda[0], dx, v->step_lambda[1] * dy) + v->lambda),
               u = fma(fma(v->step_u[0], dx, v->step_u[1] * dy), inverse, v->part_u),
               slope = v->step_v[2] * inverse,
               lowest =
                   fma(fma(v->step_v[2], dz, fma(v->step_v[0], dx, v->step_v[1] * dy)), inverse, v->part_v),
               highest = fma(slope, (double)(heights - 1), lowest);
  const int whole_u = floor_of(u), whole_v = (int)v->whole_v - 3,
            column = clamp((int)v->whole_u + whole_u - 3, 0, s.last_column);
  // A row more on either side: floats may round to it.
  const int low = clamp(whole_v + floor_of(min(lowest, highest)) - 1, 0, s.last_row) / 16 * 16,
            high = clamp(whole_v + floor_of(max(lowest, highest)) + 1, 0, s.last_row) + VDVR_CONE_HEIGHTS,
            chunks = min((high - low + 15) / 16, CHUNKS);
  const Place place = {lowest - 0.5f,
                       slope,
                       (float)(inverse * inverse) * taps((float)(u - (double)whole_u - 0.5f)),
                       (size_t)column * s.column_stride + low,
                       whole_v - low,
                       chunks,
                       min(chunks * 16 - VDVR_CONE_HEIGHTS, s.last_row - low)};
  return place;
}

typedef float4 __attribute__((aligned(4))) Loose;
#define BELOW(i) *(const Loose*)(strip + row[i])
#define ABOVE(i) (*(const Loose*)(strip + row[i] + 4)).wzyx
// What views together see at heights i, i + 4, j and j + 4 of eight: of each height four sums, of two taps
// equally far from its place. Taps on either side of a place take the same polynomials, and four heights
// share a vector of each side, the upper one from the outside in. Heights are picked so that processors
// spread places within halves of a vector. EACH has the four places four times each.
#define SUM_FOUR(NAME, i, j, EACH)                                                                           \
  static ALWAYS_INLINE float16 NAME(const Seen* seen, int views, int first) {                                \
    float16 below = (float16)(0.0f), above = (float16)(0.0f);                                                \
    for (int v = 0; v < views; ++v) {                                                                        \
      const float* strip = (const float*)seen[v].strip;                                                      \
      const int* row = seen[v].row + first;                                                                  \
      const float8 places = *(const float8*)(seen[v].g + first);                                             \
      const float16 place = places.EACH, square = place * place, even = EVEN_TAPS(square),                   \
                    odd = ODD_TAPS(square);                                                                  \
      below = fma(fma(place, odd, even), (float16)(BELOW(i), BELOW(i + 4), BELOW(j), BELOW(j + 4)), below);  \
      above = fma(fma(-place, odd, even), (float16)(ABOVE(i), ABOVE(i + 4), ABOVE(j), ABOVE(j + 4)), above); \
    }                                                                                                        \
    return below + above.s32107654ba98fedc;                                                                  \
  }
SUM_FOUR(first_and_second, 0, 1, s0000444411115555)
SUM_FOUR(third_and_fourth, 2, 3, s2222666633337777)

// Of two vectors the lower two or the upper two of each half, in turns.
#define LOWER(a, b) ((float8)((a).s0, (b).s0, (a).s1, (b).s1, (a).s4, (b).s4, (a).s5, (b).s5))
#define UPPER(a, b) ((float8)((a).s2, (b).s2, (a).s3, (b).s3, (a).s6, (b).s6, (a).s7, (b).s7))
// Adds eight heights of some views: the order is that of sum_of.
static ALWAYS_INLINE void add_heights(float* to, const Seen* seen, int views, int first) {
  const float16 s = first_and_second(seen, views, first), t = third_and_fourth(seen, views, first);
  const float8 low = LOWER(s.lo, t.lo) + UPPER(s.lo, t.lo), high = LOWER(s.hi, t.hi) + UPPER(s.hi, t.hi);
  vstore8(vload8(0, to) + (LOWER(low, high) + UPPER(low, high)), 0, to);
}

__kernel void cone_runs(__global float* out, __global const float* table, __global const ConeView* views,
                        __global const int4* wanted, ulong first, VdvrConeNodes s) {
  const int first_y = (int)get_global_id(0) * VDVR_CONE_ROWS, height = (int)get_global_id(1) * RUN,
            tile = (int)get_global_id(2), heights = min(s.groups * VDVR_CONE_HEIGHTS - height, RUN);
  if (first_y >= VDVR_CONE_TILE || heights <= 0 || tile >= s.tiles) return;
  const double half_side = 0.5f * (double)(VDVR_CONE_TILE - 1),
               dz = (double)height - 0.5f * (double)(s.groups * VDVR_CONE_HEIGHTS - 1);
  __global const ConeView* of_tile = views + (size_t)tile * s.views;
  __global const int4* ranges = wanted + tile * VDVR_CONE_TILE + first_y;
  // All rows of a tile want the same heights.
  if (height >= ranges[0].w || height + heights <= ranges[0].z) return;
  float sums[VDVR_CONE_ROWS * VDVR_CONE_TILE * RUN];
  for (int i = 0; i < VDVR_CONE_ROWS * VDVR_CONE_TILE * RUN / 16; ++i) vstore16((float16)(0.0f), i, sums);
  Seen seen[TOGETHER];
  for (int k = 0; k < s.views; k += TOGETHER) {
    const int together = min(TOGETHER, s.views - k);
    for (int y = 0; y < VDVR_CONE_ROWS; ++y)
      for (int x = ranges[y].x; x <= ranges[y].y; ++x) {
        // By themselves: processors find several at once.
        Place places[TOGETHER];
        for (int i = 0; i < together; ++i)
          places[i] = place_in(of_tile + k + i, (double)x - half_side, (double)(first_y + y) - half_side, dz,
                               heights, s);
        for (int i = 0; i < together; ++i) {
          make_strip(seen[i].strip, table + (size_t)(k + i) * s.plane + places[i].first, s.column_stride,
                     places[i].chunks, places[i].weight);
          place_heights(seen + i, places[i].lowest, places[i].slope, places[i].whole, places[i].last);
        }
        float* to = sums + (y * VDVR_CONE_TILE + x) * RUN;
        for (int j = 0; j < heights; j += VDVR_LANES) add_heights(to + j, seen, together, j);
      }
  }
  __global float* to = out + first + (size_t)tile * s.tile + height;
  for (int y = 0; y < VDVR_CONE_ROWS; ++y)
    for (int x = ranges[y].x; x <= ranges[y].y; ++x) {
      __global float* column = to + ((size_t)(first_y + y) * VDVR_CONE_TILE + x) * s.stride;
      const float* from = sums + (y * VDVR_CONE_TILE + x) * RUN;
      for (int j = 0; j < heights / VDVR_LANES; ++j) vstore8(vload8(j, column) + vload8(j, from), j, column);
    }
}
