// What the kernels of the kept nodes of cone beam share: a view as the host gives it, and eight taps of a
// place.
#ifndef VDVR_CONE_TAPS_H
#define VDVR_CONE_TAPS_H
#include "device/lanes.h"
#include "shared/column_taps.h"

// As host/certify/kept/cone_tiles.cpp fills it.
typedef struct {
  REAL step_u[3], part_u;
  REAL step_v[3], part_v;
  REAL step_lambda[3], lambda;
  REAL whole_u, whole_v, unused[2];
} ConeView;

// Rounds what lies below 2^22 to the nearest whole number where it is added.
#define TO_WHOLE 12582912.0f

// Of taps -3 .. 4.
#define FIRST_OF(a, b, c) a
#define SECOND_OF(a, b, c) b
#define THIRD_OF(a, b, c) c
// A list becomes arguments where it is handed on: OpenCL C has no macros of any number of them.
#define TAKE(pick, list) pick(list)
#define TAP(pick, kind, tap) TAKE(pick, VDVR_EIGHT_##kind##_##tap)
#define LANES(a, b, c, d, sign) (float8)(a, b, c, d, sign(d), sign(c), sign(b), sign(a))
#define COEFFICIENTS(pick, kind, sign) \
  LANES(TAP(pick, kind, A), TAP(pick, kind, B), TAP(pick, kind, C), TAP(pick, kind, D), sign)
#define SAME(x) (x)
#define OPPOSITE(x) (-(x))
#define EVEN_OF(pick) COEFFICIENTS(pick, EVEN, SAME)
#define ODD_OF(pick) COEFFICIENTS(pick, ODD, OPPOSITE)

static inline __attribute__((always_inline)) float8 taps(float g) {
  const float s = g * g;
  return fma((float8)(g),
             VDVR_TAPS_FUSED_HORNER(float8, s, ODD_OF(FIRST_OF), ODD_OF(SECOND_OF), ODD_OF(THIRD_OF)),
             VDVR_TAPS_FUSED_HORNER(float8, s, EVEN_OF(FIRST_OF), EVEN_OF(SECOND_OF), EVEN_OF(THIRD_OF)));
}

// Of two places, each of which fills one half of `g`.
#define TWICE(taps) (float16)(taps, taps)
static inline __attribute__((always_inline)) float16 taps_of_two(float16 g) {
  const float16 s = g * g;
  return fma(g,
             VDVR_TAPS_FUSED_HORNER(float16, s, TWICE(ODD_OF(FIRST_OF)), TWICE(ODD_OF(SECOND_OF)),
                                    TWICE(ODD_OF(THIRD_OF))),
             VDVR_TAPS_FUSED_HORNER(float16, s, TWICE(EVEN_OF(FIRST_OF)), TWICE(EVEN_OF(SECOND_OF)),
                                    TWICE(EVEN_OF(THIRD_OF))));
}

// Eight columns of eight rows, weighed.
#define COLUMN(j) vload8(0, from + (size_t)(j)*stride)
static inline __attribute__((always_inline)) float8 across_columns(__global const float* from, int stride,
                                                                   float8 weight) {
  float8 left = (float8)(weight.s0) * COLUMN(0), right = (float8)(weight.s7) * COLUMN(7);
  left = fma((float8)(weight.s1), COLUMN(1), left);
  right = fma((float8)(weight.s6), COLUMN(6), right);
  left = fma((float8)(weight.s2), COLUMN(2), left);
  right = fma((float8)(weight.s5), COLUMN(5), right);
  left = fma((float8)(weight.s3), COLUMN(3), left);
  right = fma((float8)(weight.s4), COLUMN(4), right);
  return left + right;
}
#undef COLUMN

static inline __attribute__((always_inline)) float sum_of(float8 v) {
  const float4 four = v.lo + v.hi;
  const float2 two = four.lo + four.hi;
  return two.x + two.y;
}

#endif
