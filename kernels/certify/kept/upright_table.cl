// A table as an upright detector would have it, from that of a leaning one: by eight taps both ways
// (docs/error-bounds.md, section 16). Layouts: float out[view][column][stride], 0 beyond the last row; float
// from[view][column][row]; UprightRow rows[view][row]. In double precision where the device has it, so that
// nothing is rounded but what is stored. Called by host/certify/kept/cone_tiles.cpp.
#include "device/cone_taps.h"
#include "shared/upright_table.h"

// As host/certify/kept/upright_views.cpp fills it: eight rows of the old table from `row` on, and for column
// j eight columns around column + j + part_u + grow_u j. part_v: of the place between the two rows in the
// middle; weight: of what is read.
typedef struct {
  REAL part_u, grow_u, part_v, weight;
  int column, row, unused[2];
} UprightRow;

#if VDVR_DOUBLE
#define REAL8 double8
#define TO_REAL8(v) convert_double8(v)
#else
#define REAL8 float8
#define TO_REAL8(v) (v)
#endif

static inline __attribute__((always_inline)) REAL8 weights_of(REAL g) {
  const REAL s = g * g;
  return TAPS(REAL8, g, s, TO_REAL8);
}

#define COLUMN(j) TO_REAL8(vload8(0, at + (size_t)(j)*stride))
static inline __attribute__((always_inline)) float value_of(__global const float* at, int stride, REAL8 u,
                                                            REAL8 v, REAL weight) {
  WEIGH_COLUMNS(REAL8, u, COLUMN)
  const REAL8 all = v * (left + right);
  const REAL sum = ((all.s0 + all.s4) + (all.s2 + all.s6)) + ((all.s1 + all.s5) + (all.s3 + all.s7));
  return (float)(weight * sum);
}

__kernel void upright_table(__global float* out, __global const float* from, __global const UprightRow* rows,
                            VdvrUprightTable s) {
  const int first = (int)get_global_id(0) * VDVR_UPRIGHT_RUN, column = (int)get_global_id(1),
            view = (int)get_global_id(2);
  if (first >= s.stride || column >= s.columns || view >= s.views) return;
  __global const float* plane = from + view * s.from_plane;
  __global const UprightRow* of_view = rows + (size_t)view * s.rows;
  __global float* to = out + ((size_t)view * s.columns + column) * s.stride;
  for (int row = first; row < min(first + VDVR_UPRIGHT_RUN, s.stride); ++row) {
    float value = 0;
    if (row < s.rows) {
      __global const UprightRow* r = of_view + row;
      const REAL place = fma(r->grow_u, (REAL)column, r->part_u), nearest = rint(place);
      const int left = clamp(r->column + column + (int)nearest, 0, s.last_column);
      value = value_of(plane + (size_t)left * s.from_stride + r->row, s.from_stride,
                       weights_of(place - nearest), weights_of(r->part_v), r->weight);
    }
    to[row] = value;
  }
}
