// F of cone beam at points anywhere: out[point] = sum_k lambda^-2 q_k(u, v), by taps between the entries of
// a table at 2 to a pixel, as of a series that is oversampled twice. Layouts: float
// table[view][column][row % 2][row / 2]; float taps[step][tap % 2][tap / 2], a set for each place from one
// entry to the next; between two of them linear. Called by host/field/fdk/cone_points.cpp.
#include "shared/cone_points.h"

#define HALF (VDVR_POINT_TAPS / 2)
#if VDVR_POINT_TAPS != 16
#error "a column's taps are two vectors of eight"
#endif

// Those of even number and of odd one, at a part of an entry in [0, 1].
static inline void taps_at(float8* even, float8* odd, __global const float* taps, float part, int steps) {
  const float place = part * (float)steps;
  const int step = clamp((int)place, 0, steps - 1);
  const float8 t = (float8)(place - (float)step);
  __global const float* low = taps + (size_t)step * VDVR_POINT_TAPS;
  *even = mix(vload8(0, low), vload8(2, low), t);
  *odd = mix(vload8(1, low), vload8(3, low), t);
}

static inline float along(__global const float* row, float4 point) {
  return fma(row[0], point.x, fma(row[1], point.y, fma(row[2], point.z, row[3])));
}

__kernel void cone_points(__global float* out, __global const float* table,
                          __global const VdvrPointView* views, __global const float4* points,
                          __global const float* taps, VdvrConePoints shape) {
  const int i = (int)get_global_id(0);
  if (i >= shape.points) return;
  const float4 point = points[i];
  // View after view, however many there are at once: the same bits.
  float sum = shape.adds ? out[i] : 0.0f;
  for (int k = 0; k < shape.views; ++k) {
    const float inverse = 1.0f / along(views[k].lambda, point), u = along(views[k].u, point) * inverse,
                v = along(views[k].v, point) * inverse, whole_u = floor(u), whole_v = floor(v);
    const int column = clamp(shape.middle_u + (int)whole_u + 1 - HALF, 0, shape.columns - VDVR_POINT_TAPS),
              row = clamp(shape.middle_v + (int)whole_v + 1 - HALF, 0, shape.rows - VDVR_POINT_TAPS);
    float8 even_u, odd_u, even_v, odd_v;
    taps_at(&even_u, &odd_u, taps, u - whole_u, shape.steps);
    taps_at(&even_v, &odd_v, taps, v - whole_v, shape.steps);
    float of_columns[VDVR_POINT_TAPS];
    vstore8(even_u, 0, of_columns);
    vstore8(odd_u, 1, of_columns);
    // The first row, and every second one after it, are of one phase; those between are of the other.
    const int phase = shape.row_stride / 2;
    __global const float* first =
        table + ((size_t)k * shape.columns + column) * shape.row_stride + (row % 2) * phase + row / 2;
    __global const float* second = table + ((size_t)k * shape.columns + column) * shape.row_stride +
                                   ((row + 1) % 2) * phase + (row + 1) / 2;
    float8 total = (float8)(0.0f);
    for (int c = 0; c < VDVR_POINT_TAPS; ++c, first += shape.row_stride, second += shape.row_stride)
      total = fma((float8)(of_columns[c % 2 * HALF + c / 2]),
                  fma(even_v, vload8(0, first), odd_v * vload8(0, second)), total);
    const float4 four = total.lo + total.hi;
    sum = fma(inverse * inverse, (four.x + four.y) + (four.z + four.w), sum);
  }
  out[i] = sum;
}
