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
  float g[RUN];
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

// dx, dy, dz: nodes from the tile's middle to the lowest of so many heights.
static ALWAYS_INLINE void look_at(Seen* seen, __global const float* plane, __global const ConeView* v,
                                  double dx, double dy, double dz, int heights, int column_stride,
                                  int last_column, int last_row) {
  const double inverse = 1.0f / (fma(v->step_lambda[0], dx, v->step_lambda[1] * dy) + v->lambda),
               u = fma(fma(v->step_u[0], dx, v->step_u[1] * dy), inverse, v->part_u),
               slope = v->step_v[2] * inverse,
               lowest =
                   fma(fma(v->step_v[2], dz, fma(v->step_v[0], dx, v->step_v[1] * dy)), inverse, v->part_v),
               highest = fma(slope, (double)(heights - 1), lowest);
  const int whole_u = floor_of(u), whole_v = (int)v->whole_v - 3,
            column = clamp((int)v->whole_u + whole_u - 3, 0, last_column);
  // A row more on either side: floats may round to it.
  const int low = clamp(whole_v + floor_of(min(lowest, highest)) - 1, 0, last_row) / 16 * 16,
            high = clamp(whole_v + floor_of(max(lowest, highest)) + 1, 0, last_row) + VDVR_CONE_HEIGHTS,
            chunks = min((high - low + 15) / 16, CHUNKS);
  make_strip(seen->strip, plane + (size_t)column * column_stride + low, column_stride, chunks,
             (float)(inverse * inverse) * taps((float)(u - (double)whole_u - 0.5f)));
  place_heights(seen, lowest - 0.5f, slope, whole_v - low,
                min(chunks * 16 - VDVR_CONE_HEIGHTS, last_row - low));
}

#define FOR_PAIRS(DO) DO(0, 0, 1) DO(1, 2, 3) DO(2, 4, 5) DO(3, 6, 7)
#define CLEAR(n, i, j) float16 sum##n = (float16)(0.0f);
#define ADD(n, i, j)                                                                      \
  {                                                                                       \
    const float16 place = (float16)((float8)(g[i]), (float8)(g[j])),                      \
                  rows = (float16)(vload8(0, strip + row[i]), vload8(0, strip + row[j])); \
    sum##n = fma(taps_of_two(place), rows, sum##n);                                       \
  }
#define PUT(n, i, j)          \
  to[i] += sum_of(sum##n.lo); \
  to[j] += sum_of(sum##n.hi);
// Adds eight heights of some views, two of them in a vector.
static ALWAYS_INLINE void add_heights(float* to, const Seen* seen, int views, int first) {
  FOR_PAIRS(CLEAR)
  for (int k = 0; k < views; ++k) {
    const float *strip = (const float*)seen[k].strip, *g = seen[k].g + first;
    const int* row = seen[k].row + first;
    FOR_PAIRS(ADD)
  }
  FOR_PAIRS(PUT)
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
        for (int i = 0; i < together; ++i)
          look_at(seen + i, table + (size_t)(k + i) * s.plane, of_tile + k + i, (double)x - half_side,
                  (double)(first_y + y) - half_side, dz, heights, s.column_stride, s.last_column, s.last_row);
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
